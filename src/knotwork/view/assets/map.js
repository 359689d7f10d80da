// The map has a cell or a dot for each row; the chosen row is shown beside it.

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

// Position and size of a row on the canvas
function layout() {
  const canvas = byId("map");
  const [width, height] = [canvas.clientWidth - ROOM.left - ROOM.right, canvas.clientHeight - ROOM.top - ROOM.bottom];
  const [x, y] = [axis("across"), axis("up")];
  const cells = data.grid && x.names.length > 0 && y.names.length > 0;
  const share = (axis, value) => {
    const [low, high] = span(axis);
    return axis.names.length ? (value - low) / (high - low) : 0.04 + (0.92 * (value - low)) / (high - low || 1);
  };
  const place = (i) => [ROOM.left + share(x, x.at[i]) * width, ROOM.top + (1 - share(y, y.at[i])) * height];
  const size = cells ? [width / x.names.length, height / y.names.length] : [9, 9];
  return { x, y, cells, place, size, share, width, height };
}

function colours() {
  const name = byId("colour").value;
  const values = data.figures[name];
  if (!values) return { of: (i) => data.palette[data.kind[i]] };
  const known = values.filter((value) => value !== null);
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
  const marks = (axis, most) => {
    const count = axis.names.length;
    const [low, high] = span(axis);
    if (!count) return [...Array(most).keys()].map((k) => low + (k / (most - 1)) * (high - low)).map((value) => [value, `${+value.toPrecision(3)}`]);
    const step = Math.ceil(count / most);
    return axis.names.map((name, k) => [k, name]).filter(([k]) => k % step === 0);
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
    const scale = `width: 120px; background: linear-gradient(to right, ${SCALE.map((colour) => `rgb(${colour})`).join()})`;
    return byId("legend").replaceChildren(entry(scale, `${name}: ${low.toPrecision(3)} to ${high.toPrecision(3)}; grey: does not pass`));
  }
  const kinds = Object.entries(data.palette).map(([kind, colour]) => [kind, colour, data.kind.filter((other) => other === kind).length]);
  return byId("legend").replaceChildren(...kinds.filter(([, , count]) => count).map(([kind, colour, count]) => entry(`background: ${colour}`, `${kind} (${count})`)));
}

// Show the motion of a row, or the reason why it has none.
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
  const frame = byId("motion");
  // Until this row's motion is loaded, none is shown, because another row has another verdict.
  frame.classList.add("awaited");
  frame.hidden = !moves || Boolean(data.command);
  byId("row").textContent = words + (!moves ? "" : data.command ? ` · its motion is shown by: ${data.command}` : " · its motion is being planned …");
  if (data.command) return;
  frame.onload = () => {
    if (chosen !== i || !frame.contentDocument?.URL.endsWith(`motion?row=${data.row[i]}`)) return;
    byId("row").textContent = words;
    frame.classList.remove("awaited");
  };
  frame.src = moves ? `motion?row=${data.row[i]}` : "about:blank";
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
  const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
  if (!step) return;
  event.preventDefault();
  choose((chosen + step + data.row.length) % data.row.length);
});
for (const id of ["across", "up", "colour"]) byId(id).addEventListener("change", draw);
window.addEventListener("resize", draw);
draw();
choose(0);
