// Labels beside their points, without overlaps; if there are many, some wait until the pointer is near.

// Failures come and go, so their labels are placed last, and others do not move.
const ORDER = { waypoint: 1, object: 2, frame: 3, miss: 4 };
// Offsets of a label from its point [pixels], in rings, the upper right first
const PLACES = [16, 30, 48, 70, 96, 126, 165, 210, 270, 340, 420].flatMap((radius) =>
  [...Array(12).keys()].map((k) => {
    const angle = ((k % 2 ? -1 : 1) * Math.ceil(k / 2) * Math.PI) / 6 - Math.PI / 3;
    return [radius * Math.cos(angle), radius * Math.sin(angle)];
  }));

// Area of the pane per label [pixels²], and distance at which the pointer calls one [pixels]
const ROOM = 55000;
const NEAR = 34;
// A label further from its point is left out, unless it is called.
const FAR = 100;
// Maximum number of labels of failures at once: those nearest to the time shown, within a fraction of the motion.
const MISSES = 3;
const SOON = 0.12;
const GRID = 24; // distance between further places [pixels]
// Margin of a label from the outlines of the arm, which are slightly too small [pixels]
const ARM_MARGIN = 6;

// Common area of two boxes [left, top, right, bottom]
const overlap = (a, b) =>
  Math.max(Math.min(a[2], b[2]) - Math.max(a[0], b[0]), 0) * Math.max(Math.min(a[3], b[3]) - Math.max(a[1], b[1]), 0);

// A box with a margin around it
const padded = ([left, top, right, bottom], margin) => [left - margin, top - margin, right + margin, bottom + margin];

// Boxes of one size, all over the pane
function spread(pane, width, height) {
  const along = (most, size) => [...Array(Math.max(Math.floor((most - size) / GRID) + 1, 1)).keys()].map((k) => 2 + k * GRID);
  return along(pane.height, height).flatMap((top) => along(pane.width, width).map((left) => [left, top, left + width, top + height]));
}

const SIDES = [-1, 0, 1].flatMap((x) => [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((z) => [x, y, z]))).filter((side) => side.some(Boolean));

// The outermost vertices of a mesh
function outermost({ geometry }) {
  const { array } = geometry.getAttribute("position");
  const best = SIDES.map(() => [-Infinity, 0]);
  for (let i = 0; i < array.length; i += 3) {
    SIDES.forEach(([x, y, z], k) => {
      const far = x * array[i] + y * array[i + 1] + z * array[i + 2];
      if (far > best[k][0]) best[k] = [far, i];
    });
  }
  return [...new Set(best.map(([, i]) => i))].map((i) => new THREE.Vector3(...array.slice(i, i + 3)));
}

class Labels {
  constructor(viewer) {
    this.viewer = viewer;
    this.labels = [];
    this.called = null;
    byId("scene").addEventListener("pointermove", (event) => this.call(event));
    byId("scene").addEventListener("pointerleave", () => this.call(null));
  }

  // The waiting label whose point is nearest to the pointer
  call(event) {
    const pane = event && paneBox();
    const away = ({ x, y }) => Math.hypot(x - event.clientX + pane.left, y - event.clientY + pane.top);
    const near = event ? this.labels.filter((label) => label.visible && away(label) < NEAR) : [];
    const called = near.length ? near.reduce((best, label) => (away(label) < away(best) ? label : best)) : null;
    if (called === this.called) return;
    this.called = called;
    this.again = true;
  }

  set({ labels, joints }, links) {
    if (links !== this.links) this.outermost = null;
    this.links = links;
    byId("labels").replaceChildren();
    byId("leaders").replaceChildren();
    this.view = ""; // the view for which labels were placed
    this.labels = labels.map((label) => {
      const box = document.createElement("div");
      box.className = `label ${label.kind}`;
      box.textContent = label.text;
      box.title = label.detail;
      byId("labels").appendChild(box);
      const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
      line.setAttribute("class", label.kind);
      byId("leaders").appendChild(line);
      const { kind, time = null } = label;
      return { box, line, point: this.point(label, joints), moves: label.carrier > 0, kind, time, at: -1, visible: false };
    }).sort((a, b) => ORDER[a.kind] - ORDER[b.kind]);
  }

  // Outlines of the arm's parts on the screen, as convex polygons
  outlines(pane) {
    const { camera } = this.viewer;
    const parts = this.links.flat();
    this.outermost ??= parts.map(outermost);
    return parts.map((part, i) => {
      part.updateWorldMatrix(true, false);
      return hull(this.outermost[i].map((point) => {
        const p = point.clone().applyMatrix4(part.matrixWorld).project(camera);
        return [((p.x + 1) / 2) * pane.width, ((1 - p.y) / 2) * pane.height];
      }));
    });
  }

  // The present point of a label, which moves with the joint that carries it
  point({ at, carrier }, joints) {
    if (!carrier) return () => world(at);
    const holder = this.viewer.scene_tree.find(pathOf(joints, carrier)).object;
    return () => holder.localToWorld(new THREE.Vector3(...at));
  }

  show(on) {
    for (const id of ["labels", "leaders"]) byId(id).style.display = on ? "" : "none";
  }

  // Failures near a time [s], in a motion of this duration [s]
  near(time, duration, pane) {
    const misses = this.labels.filter((label) => label.kind === "miss");
    const away = (label) => Math.abs((label.time ?? time) - time);
    const soon = misses.filter((label) => away(label) <= SOON * duration);
    const most = Math.max(1, Math.min(MISSES, Math.round((pane.width * pane.height) / ROOM)));
    return soon.sort((a, b) => away(a) - away(b)).slice(0, most);
  }

  // Place all labels again if the view has changed.
  place(time, duration) {
    const { camera } = this.viewer;
    camera.updateMatrixWorld();
    const pane = paneBox();
    const size = `${pane.width} ${pane.height}`;
    const moved = this.labels.filter((label) => label.moves).flatMap((label) => label.point().toArray());
    const misses = this.near(time, duration, pane);
    const chosen = this.labels.map((label, i) => (misses.includes(label) ? i : -1)).filter((i) => i >= 0);
    const taken = panels(pane);
    const view = [size, ...taken.flat().map(Math.round), ";", ...camera.matrixWorld.elements, ...camera.projectionMatrix.elements, ...moved, ";", ...chosen, misses.length ? time : ""].join();
    if (view === this.view && !this.again) return;
    this.again = false;
    // While the scene turns, labels stay on their side of the point; in a resized window they are placed again.
    if (!this.view.startsWith(`${size},`)) for (const label of this.labels) label.at = -1;
    this.view = view;
    for (const label of this.labels) {
      const { width, height } = label.box.getBoundingClientRect(); // on a phone labels are smaller
      const p = label.point().project(camera);
      const visible = p.z < 1 && Math.abs(p.x) < 1 && Math.abs(p.y) < 1;
      const [x, y] = [((p.x + 1) / 2) * pane.width, ((1 - p.y) / 2) * pane.height];
      if (visible) taken.push([x - 4, y - 4, x + 4, y + 4]);
      Object.assign(label, { width, height, visible, x, y });
    }
    this.arm = misses.length ? this.outlines(pane) : [];
    const { called } = this;
    const kept = (label) => label === called || misses.includes(label);
    const order = called ? [called, ...this.labels.filter((label) => label !== called)] : this.labels;
    let room = Math.round((pane.width * pane.height) / ROOM);
    for (const label of order) {
      const shown = kept(label) || (room > 0 && label.kind !== "miss");
      this.placeOne(label, taken, pane, shown, kept(label) ? Infinity : FAR);
      if (!kept(label) && label.at >= 0) room -= 1;
    }
  }

  placeOne(label, taken, pane, shown, far) {
    const { box, line, x, y, width, height } = label;
    const miss = label.kind === "miss";
    const near = (choice) => choice >= 0 && Math.hypot(...PLACES[choice]) <= far;
    const last = miss ? [] : [label.at]; // a time looks the same, whether it is sought or opened
    const choices = label.visible && shown ? [...last, ...PLACES.keys()].filter(near) : [];
    const inside = (value, most) => Math.max(Math.min(value, most - 2), 2);
    const boxes = choices.map((choice) => {
      const [dx, dy] = PLACES[choice];
      const left = inside(x + dx - (dx < 0 ? width : 0), pane.width - width);
      const top = inside(y + dy - height / 2, pane.height - height);
      return [left, top, left + width, top + height];
    });
    const onArm = (box) => (miss ? this.arm.filter((part) => touches(part, padded(box, ARM_MARGIN))).length : 0);
    const choice = boxes.findIndex((box) => !taken.some((other) => overlap(other, box)) && !onArm(box));
    let at = boxes[choice];
    // A failure always has a label; without a free place, it is where it covers least, as near as possible.
    if (!at && boxes.length && (miss || label === this.called)) {
      const covered = (box) => taken.reduce((sum, other) => sum + overlap(other, box), 0);
      const away = (box) => Math.hypot((box[0] + box[2]) / 2 - x, (box[1] + box[3]) / 2 - y);
      const cost = (box) => 1000 * covered(box) + 100 * onArm(box) + away(box);
      const costs = new Map([...boxes, ...spread(pane, width, height)].map((box) => [cost(box), box]));
      at = costs.get(Math.min(...costs.keys()));
    }
    label.at = at ? choices[Math.max(choice, 0)] : -1;
    box.style.visibility = line.style.visibility = at ? "visible" : "hidden";
    if (!at) return;
    taken.push(padded(at, 2));
    box.style.transform = `translate(${at[0]}px, ${at[1]}px)`;
    const edge = x > (at[0] + at[2]) / 2 ? at[2] : at[0];
    const ends = { x1: x, y1: y, x2: edge, y2: (at[1] + at[3]) / 2 };
    for (const [name, value] of Object.entries(ends)) line.setAttribute(name, value);
  }
}
