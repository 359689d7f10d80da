// The panel of joints, with the position of each between its limits.

// Number of decimals
const DIGITS = { deg: 1, mm: 1, rad: 3, m: 4 };

class Joints {
  constructor(player) {
    this.player = player;
    byId("joints").open = window.innerWidth > 900 && !document.documentElement.classList.contains("embedded");
  }

  set(data) {
    this.panel = data.joint_panel;
    this.rows = [...byId("joint-rows").children];
    this.positions = floats(data.arm.position);
    this.joints = data.joints.length; // joints of moving frames and other robots follow those of the robot
    this.first = data.first_joint; // and joints that carry its base frame come first
    this.frame = -1;
  }

  update() {
    const frame = this.player.frame();
    if (frame === this.frame || !byId("joints").open) return;
    this.frame = frame;
    this.panel.forEach(({ unit, factor, low, high }, i) => {
      const row = this.rows[i];
      const now = factor * this.positions[frame * this.joints + this.first + i];
      row.querySelector(".value").textContent = `${now.toFixed(DIGITS[unit] ?? 3)} ${unit === "deg" ? "°" : unit}`;
      if (row.className === "unbounded") return;
      const share = (now - low) / (high - low);
      row.querySelector("i").style.left = `${100 * Math.min(Math.max(share, 0), 1)}%`;
      const wide = Math.max(Math.abs(low), Math.abs(high));
      row.classList.toggle("beyond", now < low - 1e-6 * wide || now > high + 1e-6 * wide);
      row.classList.toggle("near", share < 0.1 || share > 0.9);
    });
  }
}
