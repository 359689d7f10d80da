// The plots, the values and the 3D view show the same time, and each can set it. Plots are drawn
// once; a window of time shifts and stretches their contents.

const AXES = { whole: null, shown: null }; // windows of time [s]
const scene = document.querySelector("iframe");
const calm = matchMedia("(prefers-reduced-motion: reduce)");
const made = (name, attributes) => {
  const element = document.createElementNS("http://www.w3.org/2000/svg", name);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  return element;
};
const short = (value) => String(Number(value.toPrecision(4))).replace("-", "−");

// A panel of a plot, in the coordinates of its drawing
class Panel {
  constructor(plot, axis, number) {
    Object.assign(this, axis, { plot, svg: plot.querySelector("svg") });
    const { width, height } = this.svg.viewBox.baseVal;
    this.box = { x: axis.left * width, y: axis.top * height, width: axis.width * width, height: axis.height * height };
    this.group = this.svg.querySelector(`[data-part="panel:${number}"]`);
    this.window = [this.start, this.end];
    this.line = Object.assign(document.createElement("div"), { className: "cursor", hidden: true });
    Object.assign(this.line.style, { top: `${100 * axis.top}%`, height: `${100 * axis.height}%` });
    plot.append(this.line);
    const clip = made("clipPath", { id: `clip-${plot.id}-${number}` });
    clip.append(made("rect", { x: this.box.x - 3, y: 0, width: this.box.width + 6, height }));
    this.svg.append(clip);
    this.ticks = made("g", {});
    this.group.append(this.ticks);
    this.own = [...this.group.querySelectorAll("[data-part^=xtick]")].map((tick) => {
      const { x, width: wide } = tick.getBBox();
      return { tick, name: tick.parentElement.parentElement !== this.group, at: x + wide / 2 }; // ticks with times, or with names of waypoints
    });
    this.parts = [...this.group.querySelectorAll("[data-part]")]
      .filter(({ dataset: { part } }) => !/^(xtick|note|panel)/.test(part))
      .flatMap((part) => {
        part.setAttribute("clip-path", `url(#${clip.id})`);
        return [...part.querySelectorAll("path, use")].filter((mark) => !mark.closest("defs"));
      })
      .map((element) => ({ element, d: element.getAttribute("d"), x: Number(element.getAttribute("x")) }));
  }

  // Points of the panel's curves as drawn, by name
  get curves() {
    if (!this.read) {
      this.read = [...this.group.querySelectorAll('[data-part^="curve:"]')].map((part) => {
        const points = [...(part.querySelector("path")?.getAttribute("d") ?? "").matchAll(/([ML]) ([-\d.e]+) ([-\d.e]+)/g)];
        return { name: part.dataset.part, starts: points.map((point) => point[1] === "M"),
          x: points.map((point) => Number(point[2])), y: points.map((point) => Number(point[3])) };
      });
    }
    return this.read;
  }

  value({ x, y, starts }, time) {
    const at = this.box.x + ((time - this.start) / (this.end - this.start)) * this.box.width;
    const i = x.findIndex((time) => time >= at - 1e-3);
    if (i < 0 || x[i] > at + 1e-3 && (i === 0 || starts[i])) return null;
    const share = i && x[i] > x[i - 1] && !starts[i] ? (at - x[i - 1]) / (x[i] - x[i - 1]) : 1;
    return this.level(i ? y[i - 1] + share * (y[i] - y[i - 1]) : y[0]);
  }

  level(y) {
    return this.low + ((this.box.y + this.box.height - y) / this.box.height) * (this.high - this.low);
  }

  place(time) {
    return (time - this.window[0]) / (this.window[1] - this.window[0]);
  }

  timeAt(event) {
    const box = this.plot.getBoundingClientRect();
    const [x, y] = [(event.clientX - box.left) / box.width - this.left, (event.clientY - box.top) / box.height - this.top];
    if (x < 0 || y < 0 || x > this.width || y > this.height) return null;
    return this.window[0] + (x / this.width) * (this.window[1] - this.window[0]);
  }

  show(from, to) {
    const { box, start, end } = this;
    const whole = from === null;
    this.window = whole ? [start, end] : [from, to];
    const factor = (end - start) / (this.window[1] - this.window[0]);
    const origin = box.x + ((this.window[0] - start) / (end - start)) * box.width;
    const moved = (x) => box.x + (x - origin) * factor;
    for (const { element, d, x } of this.parts) {
      if (d) element.setAttribute("d", d.replace(/([-\d.e]+) ([-\d.e]+)/g, (_, px, py) => `${moved(Number(px)).toFixed(3)} ${py}`));
      else if (x) element.setAttribute("x", moved(x));
      else element.setAttribute("transform", `matrix(${factor} 0 0 1 ${box.x - origin * factor} 0)`); // for an area
    }
    for (const { tick, name, at } of this.own) {
      const inside = Math.abs(moved(at) - box.x - box.width / 2) <= box.width / 2 + 1;
      tick.style.display = whole || (name && inside) ? "" : "none";
      tick.setAttribute("transform", whole ? "" : `translate(${moved(at) - at} 0)`);
    }
    this.ticks.replaceChildren(...(whole ? [] : this.newTicks()));
  }

  newTicks() {
    const [from, to] = this.window;
    const rough = (to - from) / 7;
    const ten = 10 ** Math.floor(Math.log10(rough));
    const step = [1, 2, 5, 10].map((factor) => factor * ten).find((factor) => factor >= rough);
    const y = this.box.y + this.box.height;
    const found = [];
    for (let at = Math.ceil(from / step - 1e-9) * step; at <= to + 1e-9; at += step) {
      const x = this.box.x + this.place(at) * this.box.width;
      found.push(made("path", { d: `M ${x} ${y} v 3.5`, stroke: "currentColor", "stroke-width": 0.8 }));
      if (!this.last) continue;
      const text = made("text", { x, y: y + 15, "text-anchor": "middle", "font-size": 10 });
      text.textContent = Number(at.toPrecision(8));
      found.push(text);
    }
    return found;
  }
}

const panels = [...document.querySelectorAll(".plot")].flatMap((plot) => {
  const found = JSON.parse(plot.dataset.axes).map((axis, i) => new Panel(plot, axis, i));
  const lowest = Math.max(...found.map(({ top }) => top));
  for (const panel of found) panel.last = panel.top === lowest;
  return found;
});
if (panels.length) AXES.whole = [Math.min(...panels.map(({ start }) => start)), Math.max(...panels.map(({ end }) => end))];

// The values at a time, and gauges of the joints between their limits
const curves = new Map(panels.flatMap((panel) => panel.curves.map((curve) => [curve.name, { panel, curve }])));
const cells = [...document.querySelectorAll("[data-curve]")].filter(({ dataset }) => curves.has(dataset.curve));

function showValues(time) {
  for (const cell of cells) {
    const { panel, curve } = curves.get(cell.dataset.curve);
    const value = panel.value(curve, time);
    cell.textContent = value === null ? "–" : short(Math.abs(value) < 1e-3 * (panel.high - panel.low) ? 0 : value);
    const gauge = cell.nextElementSibling;
    if (!gauge) continue;
    const [low, high] = [Number(gauge.dataset.low), Number(gauge.dataset.high)];
    const place = gauge.classList.contains("place");
    const share = place ? (value - low) / (high - low) : Math.abs(value) / (value < 0 ? -low : high);
    gauge.firstElementChild.style[place ? "left" : "width"] = `${100 * Math.min(Math.max(share, 0), 1)}%`;
    const near = place ? Math.abs(2 * share - 1) : share;
    gauge.classList.toggle("near", near > 0.9 && near <= 1.001);
    gauge.classList.toggle("beyond", near > 1.001);
  }
}

const clock = { time: AXES.whole?.[0] ?? 0, hover: null };
function showTime(time, hover = null) {
  Object.assign(clock, { time, hover });
  const shown = hover ?? time;
  for (const panel of panels) {
    const share = panel.place(shown);
    panel.line.hidden = share < 0 || share > 1;
    panel.line.classList.toggle("hover", hover !== null);
    panel.line.style.left = `${100 * (panel.left + share * panel.width)}%`;
  }
  const readout = document.getElementById("now");
  if (readout) readout.textContent = `${shown.toFixed(3)} s`;
  showValues(shown);
}

// The window of time follows the player.
function follow(time) {
  const [from, to] = AXES.shown ?? AXES.whole ?? [time, time];
  clock.time = time;
  if (time < from || time > to) zoom(time - 0.1 * (to - from), time + 0.9 * (to - from));
  else showTime(time, clock.hover);
}

function seek(time, more = {}) {
  follow(time);
  if (scene) scene.contentWindow.postMessage({ knotworkSeek: time, ...more }, "*");
}

// The time under the pointer is shown everywhere until the pointer leaves.
function peek(time) {
  showTime(clock.time, time);
  if (scene) scene.contentWindow.postMessage({ knotworkPeek: time }, "*");
}

// Show a window of time, within the whole motion; null shows all of it.
function zoom(from, to) {
  const [start, end] = AXES.whole;
  const width = Math.max(to - from, 1e-3 * (end - start));
  const low = Math.min(Math.max(from, start), end - width);
  AXES.shown = from === null || width >= end - start ? null : [low, low + width];
  for (const panel of panels) panel.show(...(AXES.shown ?? [null, null]));
  document.getElementById("whole").disabled = !AXES.shown;
  showTime(clock.time, clock.hover);
}

function zoomBy(factor, about) {
  const [from, to] = AXES.shown ?? AXES.whole;
  zoom(about - (about - from) * factor, about + (to - about) * factor);
}

for (const plot of document.querySelectorAll(".plot")) {
  const own = panels.filter((panel) => panel.plot === plot);
  const timeAt = (event) => own.map((panel) => panel.timeAt(event)).find((time) => time !== null) ?? null;
  plot.addEventListener("pointerdown", (event) => { const time = timeAt(event); if (time !== null) seek(time); });
  plot.addEventListener("pointermove", (event) => {
    const time = timeAt(event);
    if (time !== null && event.buttons) seek(time);
    else peek(time);
  });
  plot.addEventListener("pointerleave", () => peek(null));
  plot.addEventListener("dblclick", () => zoom(null, null));
  plot.addEventListener("wheel", (event) => {
    const time = timeAt(event);
    if (time === null) return;
    const aside = event.deltaX || (event.shiftKey ? event.deltaY : 0);
    if (event.ctrlKey || event.metaKey) zoomBy(1.002 ** event.deltaY, time);
    else if (aside && AXES.shown) zoom(...AXES.shown.map((at) => at + 0.001 * aside * (AXES.shown[1] - AXES.shown[0])));
    else return;
    event.preventDefault();
  }, { passive: false });
}
document.getElementById("closer")?.addEventListener("click", () => zoomBy(0.5, clock.time));
document.getElementById("wider")?.addEventListener("click", () => zoomBy(2, clock.time));
document.getElementById("whole")?.addEventListener("click", () => zoom(null, null));
for (const button of document.querySelectorAll("[data-at]")) {
  button.addEventListener("click", () => {
    seek(Number(button.dataset.at), { knotworkFrame: true });
    if (scene) scene.scrollIntoView({ behavior: calm.matches ? "auto" : "smooth", block: "nearest" });
  });
}
showTime(clock.time);
// Parts that are wider than the page can be scrolled by keys, too.
function reach() {
  for (const box of document.querySelectorAll(".wide, figure, pre")) {
    if (box.scrollWidth > box.clientWidth) box.tabIndex = 0;
    else box.removeAttribute("tabindex");
  }
}
reach();
window.addEventListener("resize", reach);
document.addEventListener("toggle", reach, true);
window.addEventListener("beforeprint", () => {
  if (panels.length) zoom(null, null);
  for (const details of document.querySelectorAll("details")) details.open = true;
});
// On paper a still picture replaces the 3D view, as soon as one has been made.
window.addEventListener("message", (event) => {
  if (scene && event.source === scene.contentWindow && Number.isFinite(event.data?.knotworkTime)) follow(event.data.knotworkTime);
  const still = document.getElementById("still");
  const picture = event.data && event.data.knotwork;
  const ours = [...document.querySelectorAll("iframe")].some((f) => f.contentWindow === event.source);
  if (!still || !ours || !String(picture).startsWith("data:image/")) return;
  still.addEventListener("load", () => document.documentElement.classList.add("has-still"), { once: true });
  still.src = picture;
});
