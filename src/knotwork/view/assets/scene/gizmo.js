// Handles are balls to click; the chosen one has arrows to drag and rings to turn.

const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];
const PULLS = [0xd8343a, 0x2e9e44, 0x2f6fe0]; // colours of the motions along and about x, y, z
const HANDLES = { waypoint: 0x2f6fe0, via: 0xe08a00, object: 0x7a6a45, frame: 0x5b7f9c, jog: 0xd2671e };
const REACH = 0.13; // length of an arrow relative to the distance from the camera; smaller in a narrow pane
const HOLD = 90; // a drag that has not moved for this time pauses [ms]

const onTop = (colour, opacity = 1) => new THREE.MeshBasicMaterial({ color: colour, depthTest: false, transparent: true, opacity });
const vector = (values) => new THREE.Vector3(...values);

class Gizmo {
  // `dragged(handle)` is called during a drag, `moved(handle, hand)` when it pauses or ends.
  constructor(viewer, { chosen, moved, dragged }) {
    Object.assign(this, { viewer, chosen, moved, dragged, handles: [], hand: null, held: null, own: false });
    this.balls = new THREE.Group();
    this.tool = new THREE.Group();
    for (const [i, axis] of AXES.entries()) this.tool.add(...this.parts(vector(axis), PULLS[i]));
    this.tool.children.forEach((part) => { part.renderOrder = 1001; });
    const all = new THREE.Group().add(this.balls, this.tool);
    viewer.set_object(["Handles"], all);
    this.ray = new THREE.Raycaster();
    const pane = byId("scene");
    pane.addEventListener("pointerdown", (event) => this.down(event), true);
    pane.addEventListener("pointermove", (event) => this.move(event), true);
    for (const name of ["pointerup", "pointercancel"]) pane.addEventListener(name, () => this.up(), true);
  }

  // An arrow along each axis and a ring about it; wide invisible parts make them easy to hit.
  parts(axis, colour) {
    const along = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 1, 0), axis);
    const about = new THREE.Quaternion().setFromUnitVectors(new THREE.Vector3(0, 0, 1), axis);
    const part = (form, turn, at, use, seen) => {
      const mesh = new THREE.Mesh(form, onTop(colour, seen ? 0.9 : 0));
      mesh.quaternion.copy(turn);
      mesh.position.copy(axis).multiplyScalar(at);
      mesh.userData = { use, axis };
      return mesh;
    };
    return [
      part(new THREE.CylinderGeometry(0.02, 0.02, 0.8, 8), along, 0.5, "pull", true),
      part(new THREE.ConeGeometry(0.07, 0.2, 16), along, 1.0, "pull", true),
      part(new THREE.CylinderGeometry(0.09, 0.09, 0.8, 8), along, 0.72, "pull", false),
      part(new THREE.TorusGeometry(0.75, 0.016, 8, 64), about, 0, "turn", true),
      part(new THREE.TorusGeometry(0.75, 0.07, 6, 32), about, 0, "turn", false),
    ];
  }

  // Show other handles; the one that is being dragged keeps its place.
  set(handles) {
    if (JSON.stringify(handles) === JSON.stringify(this.handles)) return;
    const held = this.hand && this.held;
    this.handles = handles.map((handle) => (held && same(handle, held) ? held : { ...handle }));
    this.choose(this.held);
    for (const ball of this.balls.children) ball.geometry.dispose();
    this.balls.clear();
    for (const handle of this.handles) {
      const round = !["object", "frame"].includes(handle.kind);
      const form = round ? new THREE.SphereGeometry(1, 16, 12) : new THREE.BoxGeometry(1.6, 1.6, 1.6);
      const ball = new THREE.Mesh(form, onTop(HANDLES[handle.kind], 0.85));
      ball.userData = { handle };
      ball.renderOrder = 1000;
      this.balls.add(ball);
    }
    this.viewer.set_dirty();
  }

  reach() {
    return REACH * Math.min(1, 1.5 * this.viewer.camera.aspect);
  }

  choose(handle) {
    this.held = handle ? this.handles.find((other) => same(other, handle)) ?? null : null;
    this.viewer.set_dirty();
  }

  // Handles have the same size on the screen at any distance.
  arrange() {
    const { camera } = this.viewer;
    const far = (point) => world(point).distanceTo(camera.position);
    for (const ball of this.balls.children) {
      const { handle } = ball.userData;
      ball.position.set(...handle.position);
      ball.scale.setScalar(far(handle.position) * (handle === this.held ? 0.011 : 0.0085));
    }
    const { held, tool } = this;
    tool.visible = held !== null;
    if (!held) return;
    tool.position.set(...held.position);
    tool.quaternion.set(...(this.own && held.turns ? held.quaternion : held.axes));
    tool.scale.setScalar(this.reach() * far(held.position));
    for (const part of tool.children) part.visible = part.userData.use === "pull" || held.turns;
  }

  // The ray under the pointer, in scene axes
  rayAt(event) {
    const pane = paneBox();
    const at = new THREE.Vector2(((event.clientX - pane.left) / pane.width) * 2 - 1, 1 - ((event.clientY - pane.top) / pane.height) * 2);
    this.ray.setFromCamera(at, this.viewer.camera);
    this.balls.parent.updateMatrixWorld(true);
    return this.ray.ray.clone().applyMatrix4(this.balls.parent.matrixWorld.clone().invert());
  }

  down(event) {
    if (event.button !== 0 || event.target.closest(".panel")) return;
    this.arrange();
    const ray = this.rayAt(event);
    const hit = (group) => this.ray.intersectObjects(group.children).filter(({ object }) => object.visible);
    const hits = this.held ? hit(this.tool).map(({ object }) => object.userData) : [];
    const pulled = hits.find(({ use }) => use === "pull") ?? hits[0]; // an arrow has priority over a ring
    const near = (ball) => this.distance(ball, event);
    const [ball] = this.balls.children.filter((ball) => near(ball) < 14).sort((a, b) => near(a) - near(b));
    if (!pulled && !ball) return;
    event.stopPropagation();
    const handle = pulled && !(ball && near(ball) < 8) ? this.held : ball.userData.handle;
    const first = handle !== this.held;
    if (first) {
      this.held = handle;
      this.chosen(handle);
    }
    byId("scene").setPointerCapture(event.pointerId);
    const use = handle === this.held && pulled && !(ball && near(ball) < 8) ? pulled : { use: "carry" };
    const start = { position: vector(handle.position), turn: new THREE.Quaternion(...handle.quaternion) };
    const axis = use.axis?.clone().applyQuaternion(this.tool.quaternion);
    const towards = ray.direction.clone().negate();
    this.hand = { ...use, axis, towards, ...start, gesture: `${performance.now()}`, far: false };
    this.hand.from = this.reached(ray);
    this.viewer.set_dirty();
  }

  distance(ball, event) {
    const pane = paneBox();
    const p = world(ball.userData.handle.position).project(this.viewer.camera);
    return Math.hypot(pane.left + ((p.x + 1) / 2) * pane.width - event.clientX, pane.top + ((1 - p.y) / 2) * pane.height - event.clientY);
  }

  // The point at which a ray meets the line, plane or ring of the drag
  reached(ray) {
    const { use, axis, position, towards } = this.hand;
    if (use === "pull") {
      const between = position.clone().sub(ray.origin);
      const b = axis.dot(ray.direction);
      return (b * ray.direction.dot(between) - axis.dot(between)) / Math.max(1 - b * b, 1e-6);
    }
    const plane = new THREE.Plane().setFromNormalAndCoplanarPoint(use === "turn" ? axis : towards, position);
    const point = ray.intersectPlane(plane, new THREE.Vector3());
    return point && point.sub(position);
  }

  move(event) {
    const { hand, held } = this;
    if (!hand) return;
    event.stopPropagation();
    const to = this.reached(this.rayAt(event));
    if (to === null || hand.from === null) return;
    if (hand.use === "pull") held.position = hand.position.clone().addScaledVector(hand.axis, to - hand.from).toArray();
    else if (hand.use === "carry") held.position = hand.position.clone().add(to).sub(hand.from).toArray();
    else {
      const angle = Math.atan2(hand.axis.dot(hand.from.clone().cross(to)), hand.from.dot(to));
      const turn = new THREE.Quaternion().setFromAxisAngle(hand.axis, angle);
      held.quaternion = turn.multiply(hand.turn).toArray();
    }
    hand.far = true;
    this.dragged(held);
    this.viewer.set_dirty();
    clearTimeout(hand.timer);
    hand.timer = setTimeout(() => this.moved(held, hand), HOLD);
  }

  up() {
    const { hand, held } = this;
    if (!hand) return;
    this.hand = null;
    clearTimeout(hand.timer);
    if (hand.far) this.moved(held, hand);
  }
}

const same = (a, b) => String(a.at) === String(b.at);
