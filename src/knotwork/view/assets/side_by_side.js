// One clock for both scenes, and the values of their difference.

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const frames = [...document.querySelectorAll("iframe")];
const clock = { time: 0, running: false, last: 0 };

function show() {
  frames.forEach((frame, i) => frame.contentWindow.postMessage({ knotworkSeek: data.starts[i] + clock.time }, "*"));
  const at = Math.round((clock.time / data.duration) * (data.time.length - 1));
  byId("scrub").value = clock.time / data.duration;
  byId("clock").textContent = `${clock.time.toFixed(2)} s`;
  document.querySelectorAll("#values b").forEach((value, i) => { value.textContent = data.curves[i].value[at].toPrecision(3); });
}

function run(on) {
  Object.assign(clock, { running: on, last: performance.now() });
  byId("play").textContent = on ? "❚❚" : "▶";
  byId("play").ariaLabel = on ? "pause" : "play";
}

function tick(now) {
  if (clock.running) {
    clock.time += (now - clock.last) / 1000;
    clock.last = now;
    if (clock.time >= data.duration) {
      clock.time = data.duration;
      run(false);
    }
    show();
  }
  requestAnimationFrame(tick);
}

function seek(time) {
  clock.time = Math.min(Math.max(time, 0), data.duration);
  run(false);
  show();
}

const ready = (frame) => frame.contentDocument?.documentElement?.dataset.ready === "true";

// Turns and shifts of the view in one scene are repeated in the other.
function shareCamera() {
  const viewers = frames.map((frame) => frame.contentWindow.viewer);
  const follow = (moved, follower) => {
    follower.camera.position.copy(moved.camera.position);
    follower.controls.target.copy(moved.controls.target);
    follower.controls.update();
    follower.set_dirty();
  };
  const place = ({ camera, controls }) => [...camera.position.toArray(), ...controls.target.toArray()].join();
  viewers.forEach((viewer, i) => viewer.controls.addEventListener("change", () => {
    if (place(viewer) !== place(viewers[1 - i])) follow(viewer, viewers[1 - i]);
  }));
  follow(...viewers);
}

// A click on a failure goes to its time, and shows its place in its own scene.
document.querySelectorAll("section").forEach((section, i) => section.addEventListener("click", ({ target }) => {
  const at = Number(target.closest("[data-at]")?.dataset.at ?? NaN);
  if (Number.isNaN(at)) return;
  seek(at - data.starts[i]);
  frames[i].contentWindow.postMessage({ knotworkSeek: at, knotworkFrame: true }, "*");
}));

// This clock replaces the clock of each scene.
function prepare(frame) {
  if (!ready(frame)) return setTimeout(() => prepare(frame), 100);
  const inside = frame.contentDocument;
  inside.getElementById("bar").style.display = "none";
  frame.contentWindow.dispatchEvent(new Event("resize"));
  if (frames.every(ready)) {
    shareCamera();
    const asked = /[#&]t=([\d.]+)/.exec(location.hash);
    if (asked) seek(Number(asked[1]) - data.starts[0]);
    document.documentElement.dataset.ready = "true";
  }
  return show();
}

byId("play").addEventListener("click", () => {
  if (!clock.running && clock.time >= data.duration) clock.time = 0;
  run(!clock.running);
});
byId("scrub").addEventListener("input", (event) => seek(Number(event.target.value) * data.duration));
byId("curves").addEventListener("click", (event) => {
  const { left, width } = byId("curves").getBoundingClientRect();
  seek(((event.clientX - left) / width) * data.duration);
});
document.addEventListener("keydown", (event) => {
  if (event.key !== " " || event.target.closest("button")) return;
  byId("play").click();
  event.preventDefault();
});
frames.forEach(prepare);
requestAnimationFrame(tick);
