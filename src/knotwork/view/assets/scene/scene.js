// A scene in a Meshcat viewer, made from plain data, and its interface for the page around it.

const TOUCHING = 0x8a0a0a;
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const TURN = Math.PI / 18; // turn of the view by a key [rad]

function showScene(data, options) {
  const viewer = new MeshCat.Viewer(byId("scene"));
  window.viewer = viewer;
  const stage = new Stage(viewer, options);
  stage.show(data);
  const { player, camera } = stage;
  if (byId("legend")) byId("legend").open = window.innerWidth > 700 && window.innerHeight > 440;
  camera.look();
  const asked = /[#&]t=([\d.]+)/.exec(location.hash);
  if (asked) player.seek(Number(asked[1]) - player.start);
  else if (options.autoplay && !calm.matches && !/paused/.test(location.hash)) player.toggle();
  const tick = () => {
    stage.update();
    requestAnimationFrame(tick);
  };
  tick();
  offer(stage);
  if (!options.embedded) offerVideo(viewer, player);
  viewer.render();
  document.documentElement.dataset.ready = "true";
  if (window.parent !== window) {
    givePictures(viewer);
    shareTime(stage);
  }
  if (options.editing) stage.editing = new Editing(stage);
  if (options.live !== null) followChanges(stage, options.live);
}

// The contents of the viewer; another scene can replace them without a change of the view.
class Stage {
  constructor(viewer, options) {
    Object.assign(this, { viewer, options });
    this.labels = new Labels(viewer);
    this.player = new Player(viewer.animator);
    const draw = viewer.render.bind(viewer);
    viewer.render = () => { // every drawing is of the time shown
      if (this.data) this.arrange();
      draw();
    };
    night.addEventListener("change", () => {
      addSurroundings(viewer, this.data);
      for (const item of this.data.meshes) if (item.around) item.object.material = paint(item);
      viewer.set_dirty();
    });
    this.strip = new Strip(this.player);
    this.joints = new Joints(this.player);
    this.camera = new Camera(viewer);
    document.body.addEventListener("click", (event) => {
      const button = event.target.closest("button[data-at]");
      if (button) this.goTo(Number(button.dataset.at));
    });
    this.switches = new Switches(viewer);
    Object.assign(this.player.uses, {
      "Shift ArrowLeft": () => this.camera.turn(TURN, 0),
      "Shift ArrowRight": () => this.camera.turn(-TURN, 0),
      "Shift ArrowUp": () => this.camera.turn(0, TURN),
      "Shift ArrowDown": () => this.camera.turn(0, -TURN),
      "+": () => this.camera.turn(0, 0, 1.2),
      "-": () => this.camera.turn(0, 0, 1 / 1.2),
      a: () => this.camera.choose("whole arm"),
      w: () => this.camera.choose("work"),
      c: () => document.querySelector('#switches input[name="collision shapes"]')?.click(),
    });
  }

  show(data) {
    const { viewer, labels, player } = this;
    const before = this.data && data.still === this.data.still ? this.data : null;
    if (!before) {
      viewer.scene_tree.find(ROOT).object.traverse((object) => object.geometry?.dispose());
      viewer.delete_path(ROOT);
      addLamps(viewer, data.view.towards_camera);
      this.links = addArm(viewer, data);
    }
    addSurroundings(viewer, data);
    addMarks(viewer, data, before);
    animate(viewer, data);
    labels.set(data, this.links);
    player.set(data);
    this.strip.set(data);
    this.joints.set(data);
    this.switches.set(data, labels);
    this.camera.set(data);
    const first = !before || before.revision === -1; // another robot, or its first motion, with a larger head
    if (this.data && first && !this.camera.touched) this.camera.look();
    this.data = data;
    this.uncovered = null;
    this.editing?.shown();
    viewer.set_dirty();
  }

  // Go to the time of a failure, and look at its place.
  goTo(time) {
    this.player.seek(time - this.player.start);
    const miss = this.data.labels.find((label) => label.kind === "miss" && Math.abs(label.time - time) < AT_FRAME);
    if (miss) this.camera.near(miss.at);
  }

  // Show the meshes that are present at the time shown, and hide others.
  arrange() {
    const { player } = this;
    player.update();
    this.editing?.arrange();
    showWhenThere(this.data.meshes, player.start + player.time);
    this.redden(player.start + player.time);
  }

  // Bodies are red while they are too near to each other.
  redden(time) {
    const touching = this.data.contacts.filter(({ spans }) => spans.some(([from, to]) => time >= from - AT_FRAME && time <= to + AT_FRAME));
    const joints = new Set(touching.flatMap((contact) => contact.joints));
    const bodies = new Set(touching.flatMap((contact) => contact.bodies));
    const dye = ({ material: paint }, on) => paint.emissive?.setHex(on ? TOUCHING : 0);
    this.links.forEach((parts, joint) => parts.forEach((part) => dye(part, joints.has(joint))));
    for (const { object, of } of this.data.meshes) dye(object, bodies.has(of));
    this.uncover(time, touching, joints);
  }

  // Parts between the camera and a contact are translucent, except the links in contact.
  uncover(time, touching, joints) {
    const { viewer: { camera, scene } } = this;
    camera.updateMatrixWorld();
    const seen = touching.length ? [time, ...camera.matrixWorld.elements].join() : "";
    if (seen === this.uncovered) return;
    this.uncovered = seen;
    for (const [paint, look] of this.faded ?? []) Object.assign(paint, look);
    this.faded = [];
    if (!touching.length) return;
    scene.updateMatrixWorld();
    const spans = touching.flatMap((contact) => contact.spans);
    const within = (at) => spans.some(([from, to]) => at >= from - AT_FRAME && at <= to + AT_FRAME);
    const others = this.links.filter((_, joint) => !joints.has(joint)).flat();
    const around = [...others, ...this.data.meshes.filter(({ around, of, object }) => (around || of) && object.visible).map(({ object }) => object)];
    const eye = camera.getWorldPosition(new THREE.Vector3());
    const misses = this.data.labels.filter((label) => label.kind === "miss" && within(label.time));
    const nearest = misses.sort((a, b) => Math.abs(a.time - time) - Math.abs(b.time - time)).slice(0, MISSES);
    for (const { at } of nearest) {
      const way = world(at).sub(eye);
      const ray = new THREE.Raycaster(eye, way.clone().normalize(), 0, way.length());
      for (const { object: { material: paint } } of ray.intersectObjects(around)) {
        if (this.faded.some(([faded]) => faded === paint)) continue;
        const { transparent, opacity } = paint;
        this.faded.push([paint, { transparent, opacity }]);
        Object.assign(paint, { transparent: true, opacity: 0.35 * opacity });
      }
    }
  }

  // The surroundings of the scene
  update() {
    this.player.update();
    this.strip.update();
    this.joints.update();
    const { player } = this;
    this.labels.place(player.start + player.time, this.viewer.animator.duration);
  }
}

// Parts that can be shown and hidden; the choice is kept for another scene.
class Switches {
  constructor(viewer) {
    this.viewer = viewer;
    this.chosen = new Map();
  }

  set(data, labels) {
    const list = byId("switches");
    list.replaceChildren();
    this.add("labels", (on) => labels.show(on), true);
    const named = new Map(); // paths of the meshes of each name
    data.meshes.forEach((item, number) => named.set(item.name, [...(named.get(item.name) ?? []), meshPath(data, item, number)]));
    named.delete("tool");
    const hidden = new Set(data.meshes.filter((item) => item.hidden).map((item) => item.name));
    for (const [name, paths] of named) this.add(name, (on) => paths.forEach((path) => this.viewer.set_property(path, "visible", on)), !hidden.has(name));
  }

  add(name, change, first) {
    const row = document.createElement("label");
    const box = document.createElement("input");
    const checked = this.chosen.get(name) ?? first;
    Object.assign(box, { type: "checkbox", name, defaultChecked: first, checked });
    row.append(box, ` ${name}`);
    byId("switches").append(row);
    const changed = () => {
      change(box.checked);
      this.viewer.set_dirty();
    };
    box.addEventListener("change", () => {
      this.chosen.set(name, box.checked);
      changed();
    });
    changed();
  }
}

// Interface for the page around the scene, and for tests
function offer(stage) {
  const { viewer, player, camera } = stage;
  const { animator } = viewer;
  window.knotwork = {
    seek: (time) => player.seek(time - player.start),
    time: () => player.start + player.time,
    duration: () => animator.duration,
    play: () => { if (!player.running) player.toggle(); },
    pause: () => { if (player.running) player.toggle(); },
    loop: (on) => player.loop(on),
    look: (name) => camera.choose(name),
    picture: () => viewer.capture_image(),
    renew: (text) => renew(stage, text),
  };
}

// Give the surrounding page a picture for paper, in the present view.
function givePictures(viewer) {
  const give = () => { // impossible while the frame is hidden, as on paper
    if (byId("scene").clientWidth > 0) window.parent.postMessage({ knotwork: viewer.capture_image() }, "*");
  };
  give();
  viewer.controls.addEventListener("end", give);
}

// The plots of the surrounding page share the time cursor.
function shareTime(stage) {
  const { player } = stage;
  let before = null; // the time shown before the pointer was over a plot
  const peek = (time) => {
    if (time !== null) before ??= { time: player.time, running: player.running };
    else if (!before) return;
    player.seek(time === null ? before.time : time - player.start);
    if (time !== null) return;
    if (before.running) player.toggle();
    before = null;
  };
  window.addEventListener("message", ({ source, data }) => {
    if (source !== window.parent || !data) return;
    if ("knotworkPeek" in data) peek(data.knotworkPeek);
    if (!Number.isFinite(data.knotworkSeek)) return;
    before = null;
    player.seek(data.knotworkSeek - player.start);
    if (data.knotworkFrame) stage.goTo(data.knotworkSeek);
  });
  let sent = null;
  const tell = () => {
    const time = player.start + player.time;
    if (time !== sent && !before) window.parent.postMessage({ knotworkTime: time }, "*");
    sent = time;
    requestAnimationFrame(tell);
  };
  tell();
}
