// A form for a part of the task, with a row for each value in it.

const isRow = (value) => Array.isArray(value) && value.length <= 6 && value.every((item) => typeof item !== "object");

// The values of a part, with their locations
function* valuesOf(value, at) {
  if (value === null || typeof value !== "object" || isRow(value)) yield { at, value };
  else for (const [key, item] of Object.entries(value)) yield* valuesOf(item, [...at, Array.isArray(value) ? Number(key) : key]);
}

// Input, read as YAML
function typed(text) {
  const word = text.trim();
  if (word === "true" || word === "false") return word === "true";
  return word !== "" && Number.isFinite(Number(word)) ? Number(word) : text;
}

// The fault of an input in place of a number. Words are only accepted for single values, such as `free`.
function fault(text, before, listed) {
  const word = text.trim();
  if (typeof before !== "number" || typeof typed(text) === "number" || (!listed && /^[a-z]/i.test(word))) return "";
  return `${word ? `'${word}' is no number` : "nothing is typed"}; accepted: a number, for example 0.25. The task keeps ${before}`;
}

function made(kind, settings = {}, ...inner) {
  const element = Object.assign(document.createElement(kind), settings);
  element.append(...inner);
  return element;
}

// A row with its key, a field for each number or word, and a button that removes it
function formRow({ at, value, shown, unit = "" }, from, { change, remove, refuse }) {
  const name = at.slice(from).join(".");
  const key = made("span", { className: "key", title: unit ? `${name} [${unit}]` : name }, `${shown.replaceAll(".", ".\u200b")} `, made("span", { className: "unit", textContent: unit }));
  const row = made("div", { className: isRow(value) && value.length > 1 ? "row wide" : "row" }, key);
  const fields = made("span", { className: "fields" });
  (isRow(value) ? value : [value]).forEach((item, i) => {
    const place = isRow(value) ? [...at, i] : at;
    const label = isRow(value) ? `${name} ${i + 1}` : name;
    const field = made("input", { ariaLabel: label });
    field.dataset.at = JSON.stringify(place);
    if (typeof item === "boolean") {
      Object.assign(field, { type: "checkbox", checked: item });
      field.addEventListener("change", () => (field.checked ? change(place, true) : remove(at)));
    } else {
      Object.assign(field, { type: "text", value: String(item ?? ""), title: String(item ?? ""), autocomplete: "off", spellcheck: false });
      if (typeof item === "number") field.inputMode = "decimal";
      // A number is applied when typing pauses, a word when it is complete.
      let timer = 0;
      const take = () => {
        clearTimeout(timer);
        const wrong = fault(field.value, item, isRow(value));
        if (wrong || field.ariaInvalid) refuse(wrong && `${label}: ${wrong}`);
        field.ariaInvalid = wrong ? "true" : null;
        if (!wrong && field.value.trim() !== "" && field.value !== String(item ?? "")) change(place, typed(field.value));
      };
      field.addEventListener("input", () => {
        clearTimeout(timer);
        if (typeof typed(field.value) === "number") timer = setTimeout(take, 350);
      });
      field.addEventListener("change", take);
    }
    fields.append(field);
  });
  row.append(fields, made("button", { type: "button", className: "drop", textContent: "×", title: `take ${name} out`, ariaLabel: `take ${name} out`, onclick: ({ detail }) => { if (detail < 2) remove(at); } })); // the second of a double click would meet the next row
  return row;
}
