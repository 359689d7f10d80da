// The editor of the task: clicks, drags and input are sent to the server, which returns the new state.

// Keys that can be added to a part, with their first values
const KEYS = {
  waypoints: { name: "new", after: 1, time: 1, speed: "fastest", velocity: "free", stop: true, wait: 0.5, way: "clear" },
  "scene.objects": { rpy: [0, 0, 0], in: "base", visual: true },
};
const GROUPS = [["waypoints", ["waypoints"]], ["objects", ["scene", "objects"]], ["frames", ["frames"]], ["task", []]];
const PARTS = ["limits", "tolerances", "tool", "collisions"];
const quoted = (name) => (/^waypoint \d+$/.test(name) ? name : `'${name}'`); // as in messages
const within = (data, at) => at.reduce((part, key) => part?.[key], data);

class Editing {
  constructor(stage) {
    Object.assign(this, { stage, draft: null, part: ["waypoints", 0], sent: 0, gesture: 0 });
    this.build();
    this.gizmo = new Gizmo(stage.viewer, {
      chosen: (handle) => this.pick(handle.at),
      dragged: (handle) => { if (handle.kind === "jog") this.jog.reach(handle); },
      moved: (handle, hand) => this.moved(handle, hand),
    });
    this.jog = new Jog(this);
    byId("labels").addEventListener("click", (event) => {
      const handle = this.gizmo.handles.find((own) => own.name === event.target.textContent);
      if (handle) this.pick(handle.at);
    });
    window.knotwork.edit = this;
    window.addEventListener("keydown", (event) => this.key(event), true);
    window.addEventListener("beforeunload", (event) => { if (this.draft?.unsaved) event.preventDefault(); });
  }

  build() {
    const button = (id, text, title, use) => made("button", { id, type: "button", textContent: text, title, onclick: use });
    this.state = made("span", { id: "edit-state", role: "status" });
    const selects = { id: "part", ariaLabel: "part of the task", onchange: () => this.pick(JSON.parse(byId("part").value)) };
    this.panel = made("section", { id: "edit", className: "panel keep-clear", ariaLabel: "edit" },
      made("div", { className: "tools" },
        button("undo", "↶", "undo (Ctrl+Z)", () => this.ask("undo")),
        button("redo", "↷", "redo (Ctrl+Shift+Z)", () => this.ask("redo")),
        button("save", "save", "save (Ctrl+S)", () => this.ask("save")),
        this.state),
      made("p", { id: "edit-error", role: "alert", hidden: true }),
      made("details", { id: "edit-form", open: window.innerWidth > 700 && window.innerHeight > 500 }, made("summary", { id: "file", textContent: "task" }),
        made("div", { className: "tools" }, made("select", selects), button("own-axes", "own axes", "pull and turn along the tool's own axes", () => this.turnAxes())),
        made("div", { id: "rows" }),
        made("div", { className: "tools" },
          made("select", { id: "more", ariaLabel: "add a key", onchange: () => this.more() }),
          button("remove", "remove", "take this part out of the task", () => this.remove())),
        made("div", { className: "tools" },
          button("add-here", "+ waypoint", "a waypoint where the arm is at the time shown", () => this.add("pose")),
          button("add-box", "+ box", "an object to be placed", () => this.add("box"))),
        made("p", { id: "add-where", className: "where" })));
    this.panel.addEventListener("keydown", (event) => event.stopPropagation());
    byId("bar").before(this.panel);
    // The panel covers no part of the view.
    this.panel.addEventListener("toggle", () => this.stage.camera.resized(), true);
  }

  // Take over a newer state of the draft. Handles of an older state stay until newer ones are known.
  update(state) {
    const before = this.draft;
    const { draft, error, busy } = state;
    Object.assign(this, { draft, wrong: Boolean(error) && !busy });
    this.say();
    for (const name of ["undo", "redo"]) byId(name).disabled = !draft[name];
    byId("save").disabled = !draft.unsaved;
    byId("file").textContent = draft.file;
    if (draft.handled >= this.sent || this.wrong) this.show(draft.handles);
    if (!before && draft.handles.length) this.choose(draft.handles[0].at);
    if (!before) this.stage.camera.resized(); // because the panel has appeared
    else if (draft.data && before.revision !== draft.revision) this.fill();
  }

  // Whether the motion shown is that of the present text.
  say() {
    const { draft, wrong } = this;
    this.known = this.stage.data.revision === draft.revision && !wrong;
    const { revision, ok } = draft.verdict;
    const soon = revision === draft.revision ? `${ok ? "passed" : "FAILED"} …` : "planning …"; // the verdict comes before the scene
    const words = [draft.unsaved ? "unsaved" : "saved", this.known ? "" : wrong ? "not planned" : soon];
    this.state.textContent = words.filter(Boolean).join(", ");
    this.state.className = this.known ? "" : wrong ? "wrong" : "busy";
    for (const name of ["add-here", "add-box", "jog-pose", "jog-joints"]) byId(name).disabled = !this.known;
  }

  show(handles) {
    const jogged = this.jog.handle;
    this.gizmo.set(jogged ? [...handles, jogged] : handles);
    const added = handles.find(({ at }) => `${at}`.startsWith(this.wanted ?? "-"));
    if (!added) return;
    delete this.wanted;
    this.choose(added.at);
  }

  // Adapt to another scene.
  shown() {
    if (this.draft) this.say();
    this.jog?.renew();
  }

  arrange() {
    this.gizmo.arrange();
    this.where();
  }

  // Place of a waypoint to be added
  where() {
    const { player, data } = this.stage;
    if (!this.draft?.data) return;
    const time = player.start + player.time;
    const before = data.waypoints.filter((waypoint) => waypoint.time <= time + AT_FRAME).at(-1);
    const named = (at) => within(this.draft.data, at).name ?? this.called(at);
    byId("add-where").textContent = `+ waypoint: at ${time.toFixed(2)} s${before ? `, after ${quoted(before.name)}` : ""}`;
    byId("jog-where").textContent = `a waypoint here comes after ${quoted(named(this.after()))}`;
  }

  // The chosen waypoint, or the last one
  after() {
    return this.part?.[0] === "waypoints" ? this.part : ["waypoints", this.draft.data.waypoints.length - 1];
  }

  // Request an action; its error is shown until the next action.
  async ask(action, more = {}) {
    const post = { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(more) };
    let answer;
    try {
      const got = await fetch(action + location.search, post);
      answer = got.ok ? await got.json() : { error: `refused: ${got.status} ${got.statusText}` };
    } catch {
      answer = { error: "knotwork has stopped: nothing can be changed or saved" };
    }
    this.sent = Math.max(this.sent, answer.revision ?? 0);
    this.refuse(answer.error ?? "");
    return answer;
  }

  refuse(words) {
    byId("edit-error").hidden = !words;
    byId("edit-error").textContent = words;
  }

  edit(changes, gesture = "", more = {}) {
    return this.ask("edit", { changes, gesture, ...more });
  }

  // Afterwards nothing is chosen, so that another click removes nothing.
  async remove() {
    const at = this.part;
    const taken = this.edit([{ at }], "", { structure: this.draft.structure });
    this.choose(null);
    if ((await taken).error) this.choose(at);
  }

  async moved(handle, { use, gesture }) {
    if (handle.kind === "jog") return this.jog.reach(handle);
    const { at, name, structure, position, quaternion } = handle;
    const answer = await this.ask("move", { at, name, structure, gesture, ...(use === "turn" ? { quaternion } : { position }) });
    handle.structure = answer.structure ?? structure;
  }

  async add(what, more = {}) {
    const time = this.stage.player.start + this.stage.player.time;
    const answer = await this.ask("add", { what, time, ...more });
    if (answer.at) this.wanted = String(answer.at);
  }

  key(event) {
    if (!event.ctrlKey && !event.metaKey) return;
    const name = event.key.toLowerCase();
    const redo = name === "y" || (name === "z" && event.shiftKey);
    if (name === "s") this.ask("save");
    else if (event.target.closest("input[type=text]") || !(redo || name === "z")) return;
    else this.ask(redo ? "redo" : "undo");
    event.preventDefault();
  }

  turnAxes() {
    this.gizmo.own = !this.gizmo.own;
    byId("own-axes").ariaPressed = String(this.gizmo.own);
    this.stage.viewer.set_dirty();
  }

  // When the user chooses a waypoint, the arm goes to it.
  pick(at) {
    this.choose(at);
    const name = this.part?.[0] === "waypoints" && (this.gizmo.held?.name.split(": ")[0] ?? this.called(this.part));
    const { player, data } = this.stage;
    const there = data.waypoints.find((waypoint) => waypoint.name === name);
    if (there) player.seek(there.time - player.start);
  }

  // A waypoint has the same name as in the scene, and a repeat that of its first waypoint.
  called(at) {
    const { names } = this.draft;
    const key = JSON.stringify(at);
    const first = Object.keys(names).find((place) => place.startsWith(key.replace("]", ",")));
    return names[key] ?? names[first] ?? `waypoint ${at.at(-1) + 1}`;
  }

  // The part of the task at a location, for a handle the waypoint or object that contains it, or `null`
  choose(at) {
    if (!at) {
      this.part = null;
      this.gizmo.choose(null);
      return this.fill();
    }
    const size = at[0] === "waypoints" || at[0] === "frames" ? 2 : at[0] === "scene" ? 3 : 1;
    this.part = at.slice(0, size);
    const handle = this.gizmo.handles.find((own) => same(own, { at })) ?? this.gizmo.handles.find((own) => String(own.at.slice(0, size)) === String(this.part));
    this.gizmo.choose(handle);
    if (at[0] !== "jog") this.fill();
    this.hold();
  }

  // Keep the dragged handle in view, beside the panels.
  hold() {
    const { held, hand } = this.gizmo;
    if (held && !hand) this.stage.camera.reveal(held.position, this.gizmo.reach());
  }

  fill() {
    const { data } = this.draft;
    if (!data) return; // the text can't be read
    const chosen = this.part && within(data, this.part);
    if (!chosen) this.part = null;
    const names = (at) => {
      const group = within(data, at);
      if (!at.length) return PARTS.filter((key) => key in data).map((key) => [[key], key]);
      return Object.entries(group ?? {}).map(([key, part]) => (Array.isArray(group) ? [[...at, Number(key)], part.name ?? `${part.repeat ? "repeat of " : ""}${this.called([...at, Number(key)])}`] : [[...at, key], key]));
    };
    byId("part").replaceChildren(...(chosen ? [] : [made("option", { value: "null", textContent: "choose a part" })]), ...GROUPS.map(([label, at]) => made("optgroup", { label },
      ...names(at).map(([place, text]) => made("option", { value: JSON.stringify(place), textContent: text, selected: String(place) === String(this.part) })))));
    const part = chosen ?? {};
    const kind = this.part?.slice(0, -1).join(".");
    const more = Object.keys(KEYS[kind] ?? {}).filter((key) => !(key in part));
    byId("more").hidden = !more.length;
    byId("more").replaceChildren(made("option", { textContent: "+ key" }), ...more.map((key) => made("option", { value: key, textContent: key })));
    byId("remove").hidden = !["waypoints", "scene.objects"].includes(kind);
    const focused = document.activeElement?.dataset?.at;
    const gesture = () => `${++this.gesture}`;
    const uses = { change: (at, value) => this.edit([{ at, value }], gesture()), remove: (at) => this.edit([{ at }]), refuse: (words) => this.refuse(words) };
    const rows = [...valuesOf(part, this.part ?? [])];
    const titled = ({ at }) => { // the last key, unless another row has the same
      const alone = typeof at.at(-1) === "string" && rows.filter((row) => row.at.at(-1) === at.at(-1)).length === 1;
      return (alone ? at.slice(-1) : at.slice(this.part.length)).join(".");
    };
    byId("rows").replaceChildren(...rows.map((row) => formRow({ ...row, shown: titled(row), unit: typeof row.value === "string" ? "" : this.draft.units[JSON.stringify(row.at)] }, this.part?.length, uses)));
    if (focused) byId("rows").querySelector(`[data-at='${CSS.escape(focused)}']`)?.focus();
    this.where();
  }

  // A key that the part does not have yet
  more() {
    const key = byId("more").value;
    const kind = this.part.slice(0, -1).join(".");
    if (key in KEYS[kind]) this.edit([{ at: [...this.part, key], value: KEYS[kind][key] }]);
  }
}

// A second arm, moved joint by joint or by its tool; a waypoint can be added at its state.
class Jog {
  constructor(editing) {
    Object.assign(this, { editing, q: null, handle: null, arm: null, waiting: null, asking: false });
    const button = (id, text, title, use) => made("button", { id, type: "button", textContent: text, title, onclick: use });
    this.panel = made("details", { id: "jog" }, made("summary", { textContent: "jog the arm" }),
      made("div", { id: "sliders" }),
      made("div", { className: "tools" },
        button("jog-pose", "waypoint here", "after the chosen waypoint, where the tool is", () => this.add("pose")),
        button("jog-joints", "as joints", "the same, given by joint values", () => this.add("joints"))),
      made("p", { id: "jog-where", className: "where" }));
    editing.panel.append(this.panel);
    this.panel.addEventListener("toggle", () => (this.panel.open ? this.begin() : this.end()));
  }

  // Begin where the arm is shown.
  begin() {
    const { stage } = this.editing;
    const { data, player } = stage;
    const at = player.frame() * data.joints.length;
    this.q = [...floats(data.arm.position).slice(at, at + data.joint_panel.length)];
    byId("sliders").replaceChildren(...data.joint_panel.map((joint, i) => this.slider(joint, i)));
    this.renew();
    this.ask({});
  }

  slider({ name, unit, factor, low, high }, i) {
    const digits = DIGITS[unit] ?? 3;
    const [least, most] = [low ?? -factor * 2 * Math.PI, high ?? factor * 2 * Math.PI];
    const field = made("input", { type: "range", min: least, max: most, step: "any", value: factor * this.q[i], ariaLabel: name });
    const number = made("span", { className: "value" });
    const show = () => { number.textContent = `${(factor * this.q[i]).toFixed(digits)} ${unit === "deg" ? "°" : unit}`; };
    field.addEventListener("input", () => {
      this.q[i] = Number(field.value) / factor;
      show();
      this.place();
      this.ask({});
    });
    show();
    const row = made("label", { className: "row" }, made("span", { className: "key", textContent: name.replaceAll("_", "_\u200b"), title: name }), field, number);
    row.show = () => { field.value = factor * this.q[i]; show(); };
    return row;
  }

  end() {
    this.editing.stage.viewer.delete_path(["Jogged"]);
    Object.assign(this, { arm: null, handle: null });
    this.editing.show(this.editing.draft.handles);
  }

  // Each scene draws this arm again.
  renew() {
    if (!this.panel.open) return;
    const { viewer, data } = this.editing.stage;
    const groups = [new THREE.Group()];
    data.joints.forEach(({ parent }) => {
      groups.push(new THREE.Group());
      groups[parent].add(groups[groups.length - 1]);
    });
    this.editing.stage.links.forEach((parts, joint) => {
      if (joint) groups[joint].add(...parts.map((part, i) => translucent(part.geometry, data.shapes[joint][i], 0.55, [225, 130, 50], 300)));
    });
    viewer.set_object(["Jogged"], groups[0]);
    this.arm = groups;
    this.place();
  }

  place() {
    const { joints } = this.editing.stage.data;
    joints.forEach((joint, i) => placeJoint(this.arm[i + 1], joint, this.q[i] ?? 0));
    this.editing.stage.viewer.set_dirty();
  }

  // The tool is dragged, and the joints follow.
  reach({ position, quaternion }) {
    this.ask({ position, quaternion });
  }

  // One request at a time; of waiting ones only the last is sent.
  async ask(more) {
    this.waiting = more;
    if (this.asking) return;
    this.asking = true;
    while (this.waiting) {
      const asked = this.waiting;
      this.waiting = null;
      const answer = await this.editing.ask("jog", { q: this.q, ...asked });
      if (!answer.q || !this.arm) continue;
      if (asked.position) {
        this.q = answer.q;
        byId("sliders").childNodes.forEach((row) => row.show());
        this.place();
      }
      const { position, quaternion } = answer;
      const { gizmo } = this.editing;
      if (this.handle && gizmo.hand && gizmo.held?.kind === "jog") continue; // it is being dragged
      const first = !this.handle;
      this.handle = { at: ["jog"], name: "jogged tool", kind: "jog", position, quaternion, axes: [0, 0, 0, 1], turns: true };
      this.editing.show(this.editing.draft.handles);
      if (first) gizmo.choose(this.handle);
      this.editing.hold();
    }
    this.asking = false;
  }

  add(what) {
    return this.editing.add(what, { q: this.q, after: this.editing.after() });
  }
}
