// A page that is served while its scenario is edited; each new motion replaces the last one.

function followChanges(stage, version) {
  let shown = version;
  const changes = new EventSource("changes" + location.search);
  changes.onmessage = async (event) => {
    const state = JSON.parse(event.data);
    tell(state);
    stage.editing?.update(state);
    if (state.version === shown) return;
    shown = state.version;
    const query = new URLSearchParams(location.search);
    query.set("still", stage.data.still); // the robot's parts on the page are not sent again
    const text = await (await fetch(`scene?${query}`, { cache: "no-store" })).text();
    if (state.version !== shown) return; // a newer version exists already
    renew(stage, text);
    document.documentElement.dataset.version = state.version;
  };
  changes.onerror = () => tell({ error: "", busy: false, gone: true });
}

// The last valid motion stays in view, faded, below the error.
function tell({ error, busy, gone = false }) {
  const live = byId("live");
  live.hidden = !(error || busy || gone);
  live.className = error ? "wrong panel" : "panel";
  live.textContent = error || (gone ? "knotwork has stopped; this is the last motion" : "planning …");
  document.body.classList.toggle("outdated", Boolean(error) || gone);
}

// Texts and motion from a page without scripts, with the parts of the robot that are known already
function renew(stage, text) {
  const page = new DOMParser().parseFromString(text, "text/html");
  const { joints, shapes } = stage.data;
  const data = { joints, shapes, ...JSON.parse(page.getElementById("data").textContent) };
  document.title = page.title;
  for (const id of ["head", "legend", "joints"]) {
    const [old, made] = [byId(id), page.getElementById(id)];
    if (old && made) {
      made.open = old.open;
      old.replaceWith(made);
    } else if (old) old.remove();
    else if (made) byId("left").append(made);
  }
  stage.show(data);
}
