// The strip below the slider: segments with their active limits, the use of limits, a chosen
// curve with its axis, failures, events and waypoints. A click goes to its time.

// Half the width of the slider's knob, whose middle stays this far from both ends [pixels]
const KNOB = 8;

// Clearances are shown to scale up to this multiple of the margin, or of the smallest one if larger.
const CLEAR = 5;

// A number on an axis
const plain = (value) => String(Number(value.toPrecision(3))).replace("-", "\u2212");

class Strip {
  constructor(player) {
    Object.assign(this, { player, canvas: byId("strip"), data: null, size: "" });
    const { canvas } = this;
    const seek = (event) => player.seek(this.timeAt(event));
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      seek(event);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (event.buttons) seek(event);
      this.say(this.timeAt(event));
    });
    canvas.addEventListener("pointerleave", () => { byId("tip").hidden = true; });
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { this.size = ""; });
    byId("curve").addEventListener("change", () => { this.size = ""; });
  }

  set(data) {
    this.data = { ...data.strip, use: floats(data.strip.use), waypoints: data.waypoints };
    this.size = "";
    this.curves = this.allCurves(data);
    const chosen = byId("curve").value;
    byId("curve").replaceChildren(...this.curves.map(({ name }) => new Option(name)));
    if (this.curves.some(({ name }) => name === chosen)) byId("curve").value = chosen;
    byId("curve").hidden = this.curves.length < 2;
  }

  // Curves to choose from, with names, units, times since the start, values, limits, the largest
  // value shown, and a text on each value
  allCurves(data) {
    const { player } = this;
    const { length, per_metre: factor } = data.units;
    const found = [];
    if (player.speeds) {
      const limit = this.data.speed_limit;
      found.push({ name: "tool speed", colour: "speed", unit: `${length}/s`, time: player.times,
        value: player.speeds.map((speed) => factor * speed), limits: limit ? [factor * limit] : [],
        given: this.data.given.map(([start, end, speed]) => [start, end, factor * speed]) });
    }
    if (this.data.clearance) {
      const { time, distance, pair, names, margin } = this.data.clearance;
      const least = Math.min(...distance.filter((gap) => gap !== null));
      found.push({ name: "clearance", colour: "clear", unit: length, time, limits: [factor * margin], words: pair.map((k) => `: ${names[k]}`),
        value: distance.map((gap) => (gap === null ? null : factor * gap)), most: factor * CLEAR * Math.max(margin, least, 1e-3) });
    }
    return [...found, ...this.data.curves.map((curve) => ({ ...curve, colour: "way" }))];
  }

  get chosen() {
    return this.curves[Math.max(byId("curve").selectedIndex, 0)];
  }

  timeAt(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left - KNOB) / (box.width - 2 * KNOB);
    return Math.min(Math.max(share, 0), 1) * this.player.animator.duration;
  }

  // The maximum in the time of one pixel, because a peak may be narrower
  useAt(time) {
    const { use } = this.data;
    const last = use.length - 1;
    const middle = (time / (this.player.animator.duration || 1)) * last;
    const half = (0.5 * last) / Math.max(this.canvas.clientWidth - 2 * KNOB, 1);
    const [low, high] = [middle - half, middle + half].map((at) => Math.min(Math.max(Math.round(at), 0), last));
    return Math.max(...use.slice(low, high + 1));
  }

  // Text on a time
  say(time) {
    const { player, data } = this;
    const parts = [`${(player.start + time).toFixed(2)} s`];
    const segment = data.segments.find(([start, end]) => time >= start && time < end);
    if (segment) parts.push(segment[3] ? `${segment[2]} (limit: ${segment[3]})` : segment[2]);
    const use = this.useAt(time);
    if (data.use.some((part) => part > 0)) parts.push(use < Infinity ? `${(100 * use).toFixed(0)} % of a limit` : "a limit is exceeded at a jump");
    for (const { name, unit, time: times, value, words = [] } of this.curves) {
      const at = times.findLastIndex((sample) => sample <= time + AT_FRAME);
      const known = at >= 0 && time <= times[times.length - 1] + AT_FRAME && value[at] !== null;
      if (known) parts.push(`${name} ${plain(value[at])} ${unit}${words[at] ?? ""}`);
    }
    const isNear = (at) => Math.abs(at - time) < 0.012 * player.animator.duration;
    parts.push(...data.events.filter(([at]) => isNear(at)).map(([, text]) => text));
    const near = data.waypoints.filter((stop) => isNear(stop.time - player.start));
    parts.push(...near.map((stop) => stop.name).filter(Boolean));
    const tip = byId("tip");
    tip.hidden = false;
    tip.textContent = parts.join(" · ");
    const left = this.x(time) - tip.offsetWidth / 2;
    tip.style.left = `${Math.min(Math.max(left, 0), this.canvas.clientWidth - tip.offsetWidth)}px`;
  }

  x(time) {
    return KNOB + (time / (this.player.animator.duration || 1)) * (this.canvas.clientWidth - 2 * KNOB);
  }

  update() {
    const { canvas } = this;
    const left = `${this.x(this.player.time)}px`;
    if (byId("cursor").style.left !== left) byId("cursor").style.left = left;
    const size = `${canvas.clientWidth} ${canvas.clientHeight}`;
    if (size === this.size || !canvas.clientWidth) return;
    this.size = size;
    this.draw();
  }

  // From the top: segments, use of limits, chosen curve, axis of time; as many as fit
  draw() {
    const { canvas, data, player, chosen } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const fine = window.devicePixelRatio || 1;
    Object.assign(canvas, { width: Math.round(width * fine), height: Math.round(height * fine) });
    const pen = canvas.getContext("2d");
    pen.scale(fine, fine);
    pen.font = "10.5px system-ui, sans-serif";
    const look = getComputedStyle(document.documentElement);
    const colour = (name) => look.getPropertyValue(`--${name}`).trim();
    const used = data.use.some((use) => use > 0);
    const high = height > 70;
    const top = high ? 27 : 13;
    const bottom = height > 40 ? height - 13 : height - 1;
    const parting = !chosen ? bottom : !used ? top : high ? top + Math.round(0.42 * (bottom - top)) : top;
    pen.fillStyle = colour("red");
    pen.globalAlpha = 0.22;
    for (const [start, end] of data.exceeded) pen.fillRect(this.x(start), 0, Math.max(this.x(end) - this.x(start), 3), bottom);
    pen.globalAlpha = 1;
    this.drawSegments(pen, colour, high);
    if (used && parting > top) this.drawUse(pen, colour, top, parting);
    if (chosen) this.drawCurve(pen, colour, parting + 3, bottom);
    if (bottom < height - 9) this.drawTimes(pen, colour, bottom);
    pen.fillStyle = colour("faint");
    for (const stop of data.waypoints) pen.fillRect(this.x(stop.time - player.start) - 0.5, 0, 1, bottom);
    this.drawEvents(pen, colour, top);
    pen.fillStyle = colour("red");
    for (const [start, end] of data.exceeded) pen.fillRect(this.x(start), bottom - 3, Math.max(this.x(end) - this.x(start), 3), 3);
  }

  // The part of a text that fits, or nothing
  shortened(pen, text, room) {
    let kept = text;
    while (kept.length > 3 && pen.measureText(kept).width > room) kept = `${kept.slice(0, -2).trimEnd()}…`;
    return pen.measureText(kept).width > room ? "" : kept;
  }

  // Text on a plate
  write(pen, colour, text, x, y, look) {
    pen.fillStyle = colour("name");
    pen.fillRect(x - 1, y - 9, pen.measureText(text).width + 2, 11);
    pen.fillStyle = colour(look);
    pen.fillText(text, x, y);
  }

  drawSegments(pen, colour, high) {
    this.data.segments.forEach(([start, end, name, limit], i) => {
      const [left, right] = [this.x(start), this.x(end)];
      pen.fillStyle = colour("use");
      pen.globalAlpha = i % 2 ? 0.25 : 0.5;
      pen.fillRect(left, 0, right - left, high ? 25 : 12);
      pen.globalAlpha = 1;
      for (const [text, y] of high ? [[name, 10], [limit, 22]] : [[name, 9]]) {
        const short = this.shortened(pen, text, right - left - 6);
        pen.fillStyle = colour(y > 12 ? "leader" : "ink");
        pen.fillText(short, (left + right - pen.measureText(short).width) / 2, y);
      }
    });
  }

  drawUse(pen, colour, top, bottom) {
    const high = 1.15; // largest use of a limit that is shown
    const up = (share) => bottom - ((bottom - top) * Math.min(share, high)) / high;
    const steps = Math.round(this.canvas.clientWidth - 2 * KNOB);
    for (let i = 0; i <= steps; i++) {
      const time = (i / steps) * this.player.animator.duration;
      const use = this.useAt(time);
      pen.fillStyle = colour(use > 1 ? "red" : "use");
      pen.fillRect(this.x(time) - 0.5, up(use), 1.2, bottom - up(use));
    }
    this.line(pen, colour("leader"), up(1));
    this.write(pen, colour, "100 % of a limit", KNOB + 2, up(1) + 10, "leader");
  }

  line(pen, look, y) {
    pen.strokeStyle = look;
    pen.lineWidth = 1;
    pen.setLineDash([4, 3]);
    pen.strokeRect(KNOB, y, this.canvas.clientWidth - 2 * KNOB, 0);
    pen.setLineDash([]);
  }

  drawCurve(pen, colour, top, bottom) {
    const { name, unit, time, value, limits, given = [], most: scale = Infinity, colour: look } = this.chosen;
    const known = [...value].filter((number) => number !== null);
    const reach = known.reduce((far, number) => [Math.min(far[0], number), Math.max(far[1], number)], [Infinity, -Infinity]);
    const near = limits.filter((limit) => limit <= 1.6 * Math.max(reach[1], 1e-9) && limit >= reach[0] - (reach[1] - reach[0]));
    const low = Math.min(look === "way" ? reach[0] : 0, ...near, reach[0]);
    const high = Math.max(Math.min(reach[1], scale), ...near, ...given.map(([, , speed]) => speed), low + 1e-9);
    const up = (number) => bottom - 1 - ((bottom - top - 2) * (Math.min(number, high) - low)) / (high - low);
    pen.lineWidth = 6;
    pen.strokeStyle = colour("given");
    pen.beginPath();
    for (const [start, end, speed] of given) {
      pen.moveTo(this.x(start), up(speed));
      pen.lineTo(this.x(end), up(speed));
    }
    pen.stroke();
    for (const limit of near) this.line(pen, colour(look), up(limit));
    pen.lineWidth = 1.6;
    pen.strokeStyle = colour(look);
    pen.beginPath();
    const every = Math.max(1, Math.floor(value.length / 4000));
    for (let i = 0; i < value.length; i += every) {
      if (value[i] !== null) pen[i && value[i - every] !== null ? "lineTo" : "moveTo"](this.x(time[i]), up(value[i]));
    }
    pen.stroke();
    const far = limits.filter((limit) => !near.includes(limit)).map((limit) => `, limit ${plain(limit)}`).join("");
    this.write(pen, colour, `${scale < reach[1] ? "≥ " : ""}${plain(high)} ${unit}${this.curves.length < 2 ? ` ${name}` : ""}${far}`, KNOB + 2, top + 8, look);
    if (bottom - top > 26) this.write(pen, colour, plain(low), KNOB + 2, bottom - 1, look);
    for (const limit of near) {
      const text = `${name === "clearance" ? "margin" : "limit"} ${plain(limit)} ${unit}`;
      const x = this.canvas.clientWidth - KNOB - 2 - pen.measureText(text).width;
      this.write(pen, colour, text, x, Math.min(Math.max(up(limit) + 4, top + 8), bottom - 1), look);
    }
  }

  // Round times, as many as fit
  drawTimes(pen, colour, top) {
    const { start, animator: { duration } } = this.player;
    const rough = (70 * duration) / Math.max(this.canvas.clientWidth, 1);
    const ten = 10 ** Math.floor(Math.log10(rough || 1));
    const step = [1, 2, 5, 10].map((factor) => factor * ten).find((factor) => factor >= rough) || 1;
    pen.fillStyle = colour("leader");
    for (let at = Math.ceil(start / step - 1e-6) * step; at <= start + duration + 1e-9; at += step) {
      const x = this.x(at - start);
      const text = `${Number(at.toPrecision(6))} s`;
      pen.fillRect(x - 0.5, top, 1, 3);
      pen.fillText(text, Math.min(Math.max(x - pen.measureText(text).width / 2, 0), this.canvas.clientWidth - pen.measureText(text).width), top + 12);
    }
  }

  // Events, with their names where they fit
  drawEvents(pen, colour, top) {
    let free = 0;
    this.data.events.forEach(([time, text]) => {
      const x = this.x(time);
      const width = pen.measureText(text).width;
      if (x > free && x + 5 + width < this.canvas.clientWidth) {
        this.write(pen, colour, text, x + 5, top + 10, "event");
        free = x + 5 + width;
      }
      pen.fillStyle = colour("event");
      pen.beginPath();
      [[x, top + 8], [x - 3, top + 1], [x + 3, top + 1]].forEach((corner) => pen.lineTo(...corner));
      pen.fill();
    });
  }
}
