// What the theme leaves out: names of landmarks, keys for what scrolls, buttons that copy.
document.addEventListener("DOMContentLoaded", () => {
  const each = (selector, use) => document.querySelectorAll(selector).forEach(use);
  const set = (selector, name, value) => each(selector, (one) => one.setAttribute(name, value));
  set(".caption[role=heading]", "aria-level", "2");
  set(".sidebar-drawer", "aria-label", "pages");
  set(".toc-drawer", "aria-label", "on this page");
  set("dt.sig dl", "role", "list"); // parameters of a long signature
  set("dt.sig dl > dd", "role", "listitem");
  if (!document.querySelector("h1")) {
    each("article", (one) => one.prepend(Object.assign(document.createElement("h1"), { textContent: document.title.split(" - ")[0] })));
  }
  const reach = () => each("pre, div.math .scroll, .table-wrapper, .drawing, article p", (one) => {
    if (one.scrollWidth > one.clientWidth + 1) one.tabIndex = 0;
    else one.removeAttribute("tabindex");
  });
  reach();
  addEventListener("resize", reach);
  each("div.highlight", (block) => {
    if (!block.closest(".output")) block.append(copyButton(block.querySelector("pre")));
  });
});

// Of a session the commands alone, without what it printed
function commands(text) {
  const lines = text.split("\n");
  for (const prompt of [/^(>>>|\.\.\.) ?/, /^\$ /]) {
    const typed = lines.filter((line) => prompt.test(line));
    if (typed.length) return typed.map((line) => line.replace(prompt, "")).join("\n");
  }
  return text.trimEnd();
}

function copyButton(pre) {
  const button = document.createElement("button");
  Object.assign(button, { type: "button", className: "copy", textContent: "copy" });
  button.addEventListener("click", async () => {
    const text = commands(pre.textContent);
    if (navigator.clipboard) await navigator.clipboard.writeText(text);
    else { // pages from a disk or without encryption
      const field = document.createElement("textarea");
      field.value = text;
      button.after(field);
      field.select();
      document.execCommand("copy");
      field.remove();
      button.focus();
    }
    button.textContent = "copied";
    setTimeout(() => { button.textContent = "copy"; }, 1500);
  });
  return button;
}
