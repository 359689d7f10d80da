// The map: a cell or a dot for each row; the one that is chosen is shown at its side.

const byId = (id) => document.getElementById(id);
const data = JSON.parse(byId("data").textContent);
const SCALE = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [253, 231, 37]]; // from low to high
const ROOM = { left: 66, right: 12, top: 8, bottom: 42 };
const own = { title: "row", at: data.row, names: [] };
let chosen = -1;

const option = (text, value) => Object.assign(document.createElement("option"), { textContent: text, value });
data.axes.forEach(({ title }, i) => {
  byId("across").append(option(title, i));
  byId("up").append(option(title, i));
});
if (data.axes.length < 2) byId("up").append(option("row", -1));
byId("up").value = data.axes.length > 1 ? 1 : -1;
byId("colour").append(option("verdict", ""), ...Object.keys(data.figures).map((name) => option(name, name)));

const axis = (id) => data.axes[byId(id).value] ?? own;
const span = ({ at, names }) => (names.length ? [-0.5, names.length - 0.5] : [Math.min(...at), Math.max(...at)]);

// Where a row is on the canvas, and how large
function layout() {
  const canvas = byId("map");
  const [width, height] = [canvas.clientWidth - ROOM.left - ROOM.right, canvas.clientHeight - ROOM.top - ROOM.bottom];
  const [x, y] = [axis("across"), axis("up")];
  const cells = data.grid && x.names.length > 0 && y.names.length > 0;
  const share = (one, value) => {
    const [low, high] = span(one);
    return one.names.length ? (value - low) / (high - low) : 0.04 + (0.92 * (value - low)) / (high - low || 1);
  };
  const place = (i) => [ROOM.left + share(x, x.at[i]) * width, ROOM.top + (1 - share(y, y.at[i])) * height];
  const size = cells ? [width / x.names.length, height / y.names.length] : [9, 9];
  return { x, y, cells, place, size, share, width, height };
}

function colours() {
  const name = byId("colour").value;
  const values = data.figures[name];
  if (!values) return { of: (i) => data.palette[data.kind[i]] };
  const known = values.filter((one) => one !== null);
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const of = (i) => {
    if (values[i] === null) return "rgba(128, 128, 128, 0.25)";
    const at = ((values[i] - low) / (high - low || 1)) * (SCALE.length - 1);
    const k = Math.min(Math.floor(at), SCALE.length - 2);
    return `rgb(${SCALE[k].map((part, j) => Math.round(part + (at - k) * (SCALE[k + 1][j] - part))).join()})`;
  };
  return { of, low, high, name };
}

function draw() {
  const canvas = byId("map");
  const fine = window.devicePixelRatio || 1;
  Object.assign(canvas, { width: canvas.clientWidth * fine, height: canvas.clientHeight * fine });
  const pen = canvas.getContext("2d");
  pen.scale(fine, fine);
  const made = layout();
  const paint = colours();
  data.row.forEach((_, i) => {
    const [left, top] = made.place(i);
    pen.fillStyle = paint.of(i);
    if (made.cells) pen.fillRect(left - made.size[0] / 2, top - made.size[1] / 2, made.size[0] - 1, made.size[1] - 1);
    else {
      pen.beginPath();
      pen.arc(left, top, made.size[0] / 2, 0, 7);
      pen.fill();
    }
  });
  const ink = getComputedStyle(document.body).color;
  if (chosen >= 0) {
    const [left, top] = made.place(chosen);
    Object.assign(pen, { strokeStyle: ink, lineWidth: 2.5 });
    pen.strokeRect(left - made.size[0] / 2, top - made.size[1] / 2, made.size[0] - 1, made.size[1] - 1);
  }
  ticks(pen, made, ink);
  legend(paint);
}

function ticks(pen, { x, y, share, width, height }, ink) {
  Object.assign(pen, { fillStyle: ink, font: "12px system-ui, sans-serif", textAlign: "center" });
  const marks = (one, most) => {
    const count = one.names.length;
    const [low, high] = span(one);
    if (!count) return [...Array(most).keys()].map((k) => low + (k / (most - 1)) * (high - low)).map((value) => [value, `${+value.toPrecision(3)}`]);
    const step = Math.ceil(count / most);
    return one.names.map((name, k) => [k, name]).filter(([k]) => k % step === 0);
  };
  for (const [value, text] of marks(x, Math.max(Math.floor(width / 70), 2))) pen.fillText(text, ROOM.left + share(x, value) * width, ROOM.top + height + 16);
  pen.fillText(x.title, ROOM.left + width / 2, ROOM.top + height + 34);
  pen.textAlign = "right";
  for (const [value, text] of marks(y, Math.max(Math.floor(height / 30), 2))) pen.fillText(text, ROOM.left - 6, ROOM.top + (1 - share(y, value)) * height + 4);
  pen.save();
  pen.translate(12, ROOM.top + height / 2);
  pen.rotate(-Math.PI / 2);
  pen.textAlign = "center";
  pen.fillText(y.title, 0, 0);
  pen.restore();
}

function legend({ low, high, name }) {
  const entry = (style, text) => {
    const span = document.createElement("span");
    span.append(Object.assign(document.createElement("i"), { style }), text);
    return span;
  };
  if (low !== undefined) {
    const scale = `width: 120px; background: linear-gradient(to right, ${SCALE.map((one) => `rgb(${one})`).join()})`;
    return byId("legend").replaceChildren(entry(scale, `${name}: ${low.toPrecision(3)} to ${high.toPrecision(3)}; grey: does not pass`));
  }
  const kinds = Object.entries(data.palette).map(([kind, colour]) => [kind, colour, data.kind.filter((one) => one === kind).length]);
  return byId("legend").replaceChildren(...kinds.filter(([, , count]) => count).map(([kind, colour, count]) => entry(`background: ${colour}`, `${kind} (${count})`)));
}

// Show the motion of a row; one without a motion says why in its own words.
function choose(i) {
  chosen = i;
  const given = data.axes.map(({ title }, k) => `${title} ${data.values[k][i]}`).join(", ");
  const moves = ["passed", "failed"].includes(data.verdict[i]);
  const words = `row ${data.row[i]}: ${given} · ${data.verdict[i]}`;
  const known = Object.entries(data.figures).filter(([, values]) => values[i] !== null);
  byId("figures").textContent = known.map(([name, values]) => `${name} ${+values[i].toPrecision(4)}`).join(" · ");
  byId("why").hidden = !data.message[i];
  byId("why").textContent = data.message[i];
  draw();
  // Until the motion of this row is there, none is shown: that of another row has another verdict.
  byId("motion").classList.add("awaited");
  if (data.command) inFile(i, moves, words);
  else served(i, moves, words);
}

function served(i, moves, words) {
  const frame = byId("motion");
  byId("row").textContent = moves ? `${words} · its motion is being planned …` : words;
  frame.onload = () => {
    if (chosen !== i || !frame.contentDocument?.URL.endsWith(`motion?row=${data.row[i]}`)) return;
    byId("row").textContent = words;
    frame.classList.remove("awaited");
  };
  frame.hidden = !moves;
  frame.src = moves ? `motion?row=${data.row[i]}` : "about:blank";
}

// A map without a server has some motions, or none: one page shows them all.
function inFile(i, moves, words) {
  const motion = data.motions[data.row[i]];
  byId("row").textContent = motion || !moves ? words : `${words} · its motion is not in this file; it is shown by: ${data.command}`;
  const frame = byId("motion");
  frame.hidden = !motion;
  if (!motion) return;
  if (!frame.srcdoc) frame.srcdoc = data.page;
  const show = () => {
    if (chosen !== i) return;
    if (frame.contentDocument?.documentElement?.dataset.ready !== "true") return setTimeout(show, 100);
    frame.contentWindow.knotwork.renew(motion);
    frame.classList.remove("awaited");
  };
  show();
}

byId("map").addEventListener("click", (event) => {
  const { place, size, cells } = layout();
  const away = (i) => {
    const [left, top] = place(i);
    return Math.hypot((event.offsetX - left) / size[0], (event.offsetY - top) / size[1]);
  };
  const near = data.row.reduce((best, _, i) => (best < 0 || away(i) < away(best) ? i : best), -1);
  if (near >= 0 && away(near) < (cells ? 0.75 : 2)) choose(near);
});
byId("map").addEventListener("keydown", (event) => {
  const way = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
  if (!way) return;
  event.preventDefault();
  const { place } = layout();
  if (chosen < 0) return choose(0);
  const from = place(chosen);
  const cost = (i) => {
    const [dx, dy] = place(i).map((one, k) => one - from[k]);
    const along = dx * way[0] + dy * way[1];
    return along > 1 ? along + 4 * Math.abs(dx * way[1] + dy * way[0]) : Infinity;
  };
  const next = data.row.reduce((best, _, i) => (cost(i) < cost(best) ? i : best), chosen);
  if (next !== chosen) choose(next);
});
// One variable has one axis: where it is chosen for both, they change places.
const AXES = ["across", "up"];
let before = AXES.map((id) => byId(id).value);
for (const [k, id] of AXES.entries()) {
  byId(id).addEventListener("change", () => {
    if (byId(id).value === before[1 - k]) byId(AXES[1 - k]).value = before[k];
    before = AXES.map((one) => byId(one).value);
  });
}
for (const id of [...AXES, "colour"]) byId(id).addEventListener("change", draw);
window.addEventListener("resize", draw);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
draw();
choose(0);
