// The panel of joints: where each is between its limits.

// Digits behind the point
const DIGITS = { deg: 1, mm: 1, rad: 3, m: 4 };

class Joints {
  constructor(player) {
    this.player = player;
    byId("joints").open = window.innerWidth > 900 && !document.documentElement.classList.contains("embedded");
  }

  set(data) {
    const list = byId("joint-rows");
    list.replaceChildren();
    this.rows = data.joint_panel.map(({ name, unit, factor, low, high }) => {
      const [row, word, bar, mark, value] = ["div", "span", "span", "i", "span"].map((kind) => document.createElement(kind));
      Object.assign(word, { className: "name", textContent: name, title: name });
      const text = (limit) => (limit === null ? "no limit" : `${limit.toFixed(DIGITS[unit] ?? 3)} ${unit}`);
      Object.assign(bar, { className: "bar", title: `${text(low)} to ${text(high)}` });
      value.className = "value";
      bar.append(mark);
      row.append(word, bar, value);
      list.append(row);
      return { row, mark, value, unit, factor, low, high };
    });
    this.positions = floats(data.arm.position);
    this.joints = data.joints.length; // what moves by itself comes after the robot
    this.first = data.first_joint; // and what carries its base frame comes before
    this.frame = -1;
  }

  update() {
    const frame = this.player.frame();
    if (frame === this.frame || !byId("joints").open) return;
    this.frame = frame;
    this.rows.forEach(({ row, mark, value, unit, factor, low, high }, i) => {
      const now = factor * this.positions[frame * this.joints + this.first + i];
      value.textContent = `${now.toFixed(DIGITS[unit] ?? 3)} ${unit === "deg" ? "°" : unit}`;
      const bounded = low !== null && high !== null && high > low;
      row.classList.toggle("unbounded", !bounded);
      if (!bounded) return;
      const share = (now - low) / (high - low);
      mark.style.left = `${100 * Math.min(Math.max(share, 0), 1)}%`;
      const wide = Math.max(Math.abs(low), Math.abs(high));
      row.classList.toggle("beyond", now < low - 1e-6 * wide || now > high + 1e-6 * wide);
      row.classList.toggle("near", share < 0.1 || share > 0.9);
    });
  }
}
