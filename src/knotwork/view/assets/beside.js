// One clock for the two scenes, and the curves of their difference.

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const frames = [...document.querySelectorAll("iframe")];
const KNOB = 8; // half of the slider's knob [pixels]
const clock = { time: 0, running: false, last: 0 };

function show() {
  frames.forEach((frame, i) => frame.contentWindow.postMessage({ knotworkSeek: data.starts[i] + clock.time }, "*"));
  const at = Math.min(Math.round((clock.time / data.duration) * (data.time.length - 1)), data.time.length - 1);
  byId("scrub").value = clock.time / data.duration;
  byId("clock").textContent = `${clock.time.toFixed(2)} s`;
  const colour = (i) => `background: var(--${["one", "two"][i]})`;
  byId("values").replaceChildren(...data.curves.map(({ name, unit, value }, i) => {
    const most = value.indexOf(Math.max(...value));
    const row = document.createElement("span");
    const line = Object.assign(document.createElement("i"), { style: colour(i) });
    row.append(line, `${name}: ${value[at].toPrecision(3)} ${unit}, at most ${value[most].toPrecision(3)} at ${data.time[most].toFixed(2)} s`);
    return row;
  }), ...fails());
}

// Whose failures the stretches on the time line are
function fails() {
  const words = data.names.map((name, i) => (data.broken[i].length ? `${["above", "below"][i]}: ${name}` : "")).filter(Boolean);
  if (!words.length) return [];
  const row = document.createElement("span");
  row.append(Object.assign(document.createElement("i"), { style: "background: var(--bad)" }), `fails, ${words.join(", ")}`);
  return [row];
}

// Where each curve has its greatest value, and zero, in the canvas
const ROOM = { top: 18, bottom: 18 };
const LEAST = 1e-3; // of a range, in the units shown: less is not drawn as a difference

function draw() {
  const canvas = byId("curves");
  const [width, height, fine] = [canvas.clientWidth, canvas.clientHeight, window.devicePixelRatio || 1];
  Object.assign(canvas, { width: width * fine, height: height * fine });
  const pen = canvas.getContext("2d");
  pen.scale(fine, fine);
  const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);
  const across = (time) => KNOB + (time / data.duration) * (width - 2 * KNOB);
  const up = (share) => height - ROOM.bottom - share * (height - ROOM.top - ROOM.bottom);
  const line = (points, paint, wide) => {
    Object.assign(pen, { strokeStyle: paint, lineWidth: wide });
    pen.beginPath();
    points.forEach(([x, y]) => pen.lineTo(x, y));
    pen.stroke();
  };
  const say = (text, x, y, paint, side) => {
    Object.assign(pen, { fillStyle: paint, font: "11px system-ui, sans-serif", textAlign: side });
    pen.fillText(text, x, y);
  };
  data.broken.forEach((spans, i) => spans.forEach(([from, to]) => {
    const top = i ? (up(0) + up(1)) / 2 : up(1);
    const [left, wide, high] = [across(from), across(to) - across(from), (up(0) - up(1)) / 2];
    pen.fillStyle = colour("--bad");
    pen.globalAlpha = 0.22;
    pen.fillRect(left, top, wide, high);
    pen.globalAlpha = 1;
    pen.fillRect(left, i ? top + high - 3 : top, wide, 3);
  }));
  for (const share of [0, 1]) line([[KNOB, up(share)], [width - KNOB, up(share)]], colour(share ? "--line" : "--ink"), 1);
  const step = [0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000].find((one) => across(one) - KNOB >= 60) ?? data.duration;
  for (let k = 0; k * step <= data.duration; k++) {
    const x = across(k * step);
    line([[x, up(0)], [x, up(0) + 3]], colour("--ink"), 1);
    say(`${+(k * step).toPrecision(4)}${k ? "" : " s"}`, x, height - 3, colour("--ink"), k ? "center" : "left");
  }
  data.curves.forEach(({ value, unit }, i) => {
    const most = Math.max(...value, LEAST);
    const [paint, x, side] = [colour(["--one", "--two"][i]), i ? width - KNOB : KNOB, i ? "right" : "left"];
    line(value.map((one, k) => [across(data.time[k]), up(one / most)]), paint, 1.6);
    say(`${most.toPrecision(3)} ${unit}`, x, ROOM.top - 5, paint, side);
  });
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

// What turns or moves the view in one scene does so in the other.
function shareCamera() {
  const viewers = frames.map((frame) => frame.contentWindow.viewer);
  const follow = (one, other) => {
    other.camera.position.copy(one.camera.position);
    other.controls.target.copy(one.controls.target);
    other.controls.update();
    other.set_dirty();
  };
  const place = ({ camera, controls }) => [...camera.position.toArray(), ...controls.target.toArray()].join();
  viewers.forEach((one, i) => one.controls.addEventListener("change", () => {
    if (place(one) !== place(viewers[1 - i])) follow(one, viewers[1 - i]);
  }));
  follow(...viewers);
}

// A failure is gone to, in the scene whose it is.
document.querySelectorAll("section").forEach((section, i) => section.addEventListener("click", ({ target }) => {
  const at = Number(target.closest("[data-at]")?.dataset.at ?? NaN);
  if (Number.isNaN(at)) return;
  seek(at - data.starts[i]);
  frames[i].contentWindow.postMessage({ knotworkSeek: at, knotworkFrame: true }, "*");
}));

// The scenes have a clock of their own, which this one takes the place of.
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
byId("curves").addEventListener("click", (event) => seek(((event.offsetX - KNOB) / (byId("curves").clientWidth - 2 * KNOB)) * data.duration));
document.addEventListener("keydown", (event) => {
  if (event.key !== " " || event.target.closest("button")) return;
  byId("play").click();
  event.preventDefault();
});
window.addEventListener("resize", draw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
frames.forEach(prepare);
draw();
requestAnimationFrame(tick);
