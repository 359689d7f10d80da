// Below the slider: the tool's speed and the given speed, the use of limits, clearance, failures,
// events, segments and the waypoints. A click goes to its time.

// Half of the slider's knob: its middle goes from here to as far from the other end [pixels].
const KNOB = 8;

// Clearances up to so many times the margin, or the least if that is more, are shown to scale.
const CLEAR = 5;

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
  }

  set(data) {
    this.data = { ...data.strip, use: floats(data.strip.use), waypoints: data.waypoints };
    this.size = "";
  }

  timeAt(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left - KNOB) / (box.width - 2 * KNOB);
    return Math.min(Math.max(share, 0), 1) * this.player.animator.duration;
  }

  // The most in the part of the motion that a pixel stands for: a peak may be narrower
  useAt(time) {
    const { use } = this.data;
    const last = use.length - 1;
    const middle = (time / (this.player.animator.duration || 1)) * last;
    const half = (0.5 * last) / Math.max(this.canvas.clientWidth - 2 * KNOB, 1);
    const [low, high] = [middle - half, middle + half].map((at) => Math.min(Math.max(Math.round(at), 0), last));
    return Math.max(...use.slice(low, high + 1));
  }

  // Index of the last clearance that was sampled before a time
  clearanceAt(time) {
    const { time: times } = this.data.clearance;
    const after = times.findIndex((one) => one > time);
    return after < 0 ? times.length - 1 : Math.max(after - 1, 0);
  }

  // What is at a time, in words
  say(time) {
    const { player, data } = this;
    const parts = [`${(player.start + time).toFixed(2)} s`];
    const segment = data.segments.find(([start, end]) => time >= start && time < end);
    if (segment) parts.push(segment[2]);
    const asked = data.asked.find(([start, end]) => time >= start && time <= end);
    if (player.speeds) {
      const speed = player.speedText(player.speeds[player.frame(time)], 1);
      parts.push(asked ? `${speed} of ${player.speedText(asked[2], 1)}` : speed);
    }
    const use = this.useAt(time);
    if (data.use.some((part) => part > 0)) parts.push(use < Infinity ? `${(100 * use).toFixed(0)} % of a limit` : "a limit is broken at a jump");
    if (data.clearance) {
      const { distance, pair, names } = data.clearance;
      const i = this.clearanceAt(time);
      if (distance[i] !== null) parts.push(`${player.lengthText(distance[i], 1)} clear: ${names[pair[i]]}`);
    }
    const beside = (at) => Math.abs(at - time) < 0.012 * player.animator.duration;
    parts.push(...data.events.filter(([at]) => beside(at)).map(([, said]) => said));
    const near = data.waypoints.filter((stop) => beside(stop.time - player.start));
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

  draw() {
    const { canvas, data, player } = this;
    const [width, height] = [canvas.clientWidth, canvas.clientHeight];
    const fine = window.devicePixelRatio || 1;
    Object.assign(canvas, { width: Math.round(width * fine), height: Math.round(height * fine) });
    const pen = canvas.getContext("2d");
    pen.scale(fine, fine);
    const look = getComputedStyle(document.documentElement);
    const colour = (name) => look.getPropertyValue(`--${name}`).trim();
    const high = 1.15; // of what the strip shows, in parts of a limit
    const up = (share) => height - 4 - (height - 6) * Math.min(share, high) / high;
    const steps = Math.round(width - 2 * KNOB);
    const times = [...Array(steps + 1).keys()].map((i) => (i / steps) * player.animator.duration);
    if (data.use.some((use) => use > 0)) {
      times.forEach((time) => {
        const use = this.useAt(time);
        pen.fillStyle = colour(use > 1 ? "red" : "use");
        pen.fillRect(this.x(time) - 0.5, up(use), 1.2, height - 4 - up(use));
      });
      pen.strokeStyle = colour("faint");
      pen.setLineDash([4, 3]);
      pen.strokeRect(KNOB, up(1), width - 2 * KNOB, 0);
      pen.setLineDash([]);
    }
    for (const stop of data.waypoints) {
      pen.fillStyle = colour("faint");
      pen.fillRect(this.x(stop.time - player.start) - 0.5, 0, 1, height);
    }
    if (player.speeds) this.drawSpeeds(pen, up, times, colour);
    if (data.clearance) this.drawClearance(pen, up, colour);
    this.drawNames(pen, colour);
    pen.fillStyle = colour("red");
    for (const [start, end] of data.broken) {
      pen.fillRect(this.x(start), height - 5, Math.max(this.x(end) - this.x(start), 3), 5);
    }
  }

  // Segments by name where they are long enough; events, with their names where there is room
  drawNames(pen, colour) {
    const { events, segments } = this.data;
    const write = (text, x, y, look) => {
      pen.fillStyle = colour("name");
      pen.fillRect(x - 1, y - 8, pen.measureText(text).width + 2, 10);
      pen.fillStyle = colour(look);
      pen.fillText(text, x, y);
    };
    pen.font = "9px system-ui, sans-serif";
    for (const [start, end, name] of segments) {
      const room = this.x(end) - this.x(start) - pen.measureText(name).width;
      if (room > 6) write(name, this.x(start) + room / 2, 8, "leader");
    }
    const free = [0, 0]; // of each row, from where on
    events.forEach(([time, said], i) => {
      const x = this.x(time);
      const width = pen.measureText(said).width;
      const left = x + 5 + width < this.canvas.clientWidth ? x + 5 : x - 5 - width;
      const next = i + 1 < events.length ? this.x(events[i + 1][0]) - 4 : Infinity;
      const row = free.findIndex((from, k) => left > from && (k || left + width < next));
      if (row >= 0) {
        write(said, left, 18 + 10 * row, "event");
        free[row] = left + width;
      }
      pen.fillStyle = colour("event");
      pen.beginPath();
      [[x, 18], [x - 3, 11], [x + 3, 11]].forEach((corner) => pen.lineTo(...corner));
      pen.fill();
    });
  }

  drawClearance(pen, up, colour) {
    const { time, distance, margin } = this.data.clearance;
    const found = distance.filter((one) => one !== null);
    if (!found.length) return;
    const most = CLEAR * Math.max(margin, Math.min(...found), 1e-3);
    const height = (one) => up(Math.min(Math.max(one, 0) / most, 1));
    pen.strokeStyle = colour("clear");
    pen.lineWidth = 1;
    pen.setLineDash([2, 3]);
    pen.strokeRect(KNOB, height(margin), this.x(time[time.length - 1]) - KNOB, 0);
    pen.setLineDash([]);
    pen.lineWidth = 1.6;
    pen.beginPath();
    distance.forEach((one, i) => {
      if (one !== null) pen[i && distance[i - 1] !== null ? "lineTo" : "moveTo"](this.x(time[i]), height(one));
    });
    pen.stroke();
  }

  drawSpeeds(pen, up, times, colour) {
    const { player, data } = this;
    const most = Math.max(...player.speeds, ...data.asked.map((one) => one[2]), 1e-9);
    pen.lineWidth = 6;
    pen.strokeStyle = colour("asked");
    for (const [start, end, speed] of data.asked) {
      pen.beginPath();
      pen.moveTo(this.x(start), up(speed / most));
      pen.lineTo(this.x(end), up(speed / most));
      pen.stroke();
    }
    pen.lineWidth = 1.6;
    pen.strokeStyle = colour("speed");
    pen.beginPath();
    times.forEach((time) => pen.lineTo(this.x(time), up(player.speeds[player.frame(time)] / most)));
    pen.stroke();
  }
}
