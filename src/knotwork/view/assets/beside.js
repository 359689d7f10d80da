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
  }));
}

function draw() {
  const canvas = byId("curves");
  const [width, height, fine] = [canvas.clientWidth, canvas.clientHeight, window.devicePixelRatio || 1];
  Object.assign(canvas, { width: width * fine, height: height * fine });
  const pen = canvas.getContext("2d");
  pen.scale(fine, fine);
  data.curves.forEach(({ value }, i) => {
    const most = Math.max(...value) || 1;
    pen.strokeStyle = getComputedStyle(document.documentElement).getPropertyValue(["--one", "--two"][i]);
    pen.lineWidth = 1.6;
    pen.beginPath();
    value.forEach((one, k) => pen.lineTo(KNOB + (k / (value.length - 1)) * (width - 2 * KNOB), height - 3 - (one / most) * (height - 8)));
    pen.stroke();
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

// The scenes have a clock of their own, which this one takes the place of.
function prepare(frame) {
  if (!ready(frame)) return setTimeout(() => prepare(frame), 100);
  const inside = frame.contentDocument;
  inside.getElementById("bar").style.display = "none";
  frame.contentWindow.dispatchEvent(new Event("resize"));
  if (frames.every(ready)) document.documentElement.dataset.ready = "true";
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
