// A scene in a Meshcat viewer, put together from plain data, with what the page around it may ask.

async function showScene(data, options) {
  const viewer = new MeshCat.Viewer(byId("scene"));
  window.viewer = viewer;
  const { images, ready } = textures(data.images);
  addSurroundings(viewer, data);
  addArms(viewer, data, images);
  const hideCopies = addCopies(viewer, data);
  addMarks(viewer, data);
  animate(viewer, data);
  const labels = new Labels(viewer, data.labels);
  const player = new Player(viewer.animator, data.arms[0]);
  addSwitches(viewer, data, labels, options.ghosts);
  const camera = new Camera(viewer, data);
  camera.look();
  const asked = /[#&]t=([\d.]+)/.exec(location.hash);
  if (asked) player.seek(Number(asked[1]) - player.start);
  else if (options.autoplay && !/paused/.test(location.hash)) viewer.animator.play();
  const tick = () => {
    player.update();
    labels.place();
    hideCopies(player.frame());
    showWhenThere(data.things, player.start + player.time);
    requestAnimationFrame(tick);
  };
  tick();
  offer(viewer, player);
  await ready;
  viewer.set_dirty();
  viewer.render();
  document.documentElement.dataset.ready = "true";
  if (window.parent !== window) givePictures(viewer, () => still(viewer, camera, labels));
}

// What can be shown and hidden
function addSwitches(viewer, data, labels, ghosts) {
  const show = (path) => (on) => viewer.set_property(path, "visible", on);
  const rows = { labels: (on) => labels.show(on), ghosts: show([...ROOT, "ghosts"]) };
  const hidden = new Set(data.things.filter((thing) => thing.hidden).map((thing) => thing.name));
  if (ghosts === false) hidden.add("ghosts");
  data.things.forEach((thing, number) => {
    if (thing.name === "tool") return;
    const before = rows[thing.name];
    const own = show(thingPath(data, thing, number));
    rows[thing.name] = (on) => {
      if (before) before(on);
      own(on);
    };
  });
  if (rows.deviation) {
    rows.deviation = (on) => {
      show([...ROOT, "deviation"])(on);
      byId("deviation").hidden = !on;
    };
  }
  data.arms.slice(1).forEach((arm) => { rows[`arm: ${arm.name}`] = show([...ROOT, `arm: ${arm.name}`]); });
  for (const [name, change] of Object.entries(rows)) {
    const row = document.createElement("label");
    const box = document.createElement("input");
    Object.assign(box, { type: "checkbox", name, checked: !hidden.has(name) });
    row.append(box, ` ${name}${name === "collision shapes" ? " (key c)" : ""}`);
    byId("switches").appendChild(row);
    const changed = () => {
      change(box.checked);
      viewer.set_dirty();
    };
    box.addEventListener("change", changed);
    if (!box.checked) changed();
  }
  document.addEventListener("keydown", (event) => {
    const box = document.querySelector('#switches input[name="collision shapes"]');
    if (event.key !== "c" || event.altKey || event.ctrlKey || event.metaKey || !box) return;
    if (!event.target.closest("input:not([type=range]):not([type=checkbox]), select")) box.click();
  });
}

// What the page around it, and tests, may ask for
function offer(viewer, player) {
  const { animator } = viewer;
  window.knotwork = {
    seek: (time) => player.seek(time - player.start),
    time: () => player.start + player.time,
    duration: animator.duration,
    play: () => { if (!animator.playing) player.toggle(); },
    pause: () => { if (animator.playing) player.toggle(); },
    picture: () => viewer.capture_image(),
  };
}

// Give the page around this one a picture for paper: as the scene was turned, and as wide.
function givePictures(viewer, picture) {
  const give = () => { // there is none while the frame is hidden, as on paper
    if (byId("scene").clientWidth > 0) window.parent.postMessage({ knotwork: picture() }, "*");
  };
  give();
  viewer.controls.addEventListener("end", give);
  let waiting = 0;
  window.addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(give, 300);
  });
}
