// Cameras with the whole arm or only the task in view, as large as the panels permit.

const byId = (id) => document.getElementById(id);
const paneBox = () => byId("scene").getBoundingClientRect();
const world = (point) => new THREE.Vector3(point[0], point[2], -point[1]);

// Boxes [left, top, right, bottom] of the panels over the scene, in its pixels
function panels(pane) {
  return [...document.querySelectorAll(".keep-clear")]
    .map((element) => element.getBoundingClientRect())
    .filter((box) => box.width > 0 && box.height > 0)
    .map((box) => [box.left - pane.left, box.top - pane.top, box.right - pane.left, box.bottom - pane.top]);
}

// Distance from a point at which the camera looks, relative to the scene's size
const CLOSE = 1.2;

class Camera {
  constructor(viewer) {
    this.viewer = viewer;
    this.name = "whole arm";
    this.touched = false; // turned by the user, so the camera keeps its direction
    viewer.controls.addEventListener("start", () => {
      this.touched = true;
      this.mark();
    });
    window.onload = null; // Meshcat's handler would use the whole window
    window.addEventListener("resize", () => this.resized());
    new ResizeObserver(() => this.clearBar()).observe(byId("bar"));
    for (const [id, name] of Camera.BUTTONS) byId(id).addEventListener("click", () => this.choose(name));
  }

  static BUTTONS = [["whole-arm", "whole arm"], ["work", "work"]];

  set(data) {
    this.data = data;
    byId("work").hidden = !data.work;
    this.mark();
  }

  // Look from the side of the better of the two cameras.
  choose(name) {
    if (name === "work" && !this.data.work) return;
    this.name = name;
    this.touched = false;
    this.look();
    this.mark();
  }

  // Looks at a point if one of its arrows is outside the pane or covered. Their length is relative to the camera's distance.
  reveal(point, reach) {
    const { camera } = this.viewer;
    const pane = paneBox();
    camera.updateMatrixWorld();
    const { x, y } = world(point).project(camera);
    const wide = (reach * pane.height) / (2 * Math.tan((camera.fov / 2) * (Math.PI / 180))); // [pixels]
    const [left, top] = [((x + 1) / 2) * pane.width - wide, ((1 - y) / 2) * pane.height - wide];
    const box = [left, top, left + 2 * wide, top + 2 * wide];
    const inside = left >= 0 && top >= 0 && box[2] <= pane.width && box[3] <= pane.height;
    if (!inside || panels(pane).some((panel) => overlap(panel, box))) this.near(point, Infinity);
  }

  // Look at a point from the same side and nearby, in the middle of the area without panels.
  near(point, most = CLOSE * this.data.size) {
    const { camera, controls } = this.viewer;
    const pane = paneBox();
    const [left, top, right, bottom] = roomiest(panels(pane), pane);
    const from = camera.position.clone().sub(controls.target);
    from.setLength(Math.min(from.length(), most));
    const pixel = (2 * from.length() * Math.tan((camera.fov / 2) * (Math.PI / 180))) / pane.height;
    const across = new THREE.Vector3(0, 1, 0).cross(from).normalize();
    const up = from.clone().cross(across).normalize();
    controls.target.copy(world(point))
      .addScaledVector(across, (pixel * (pane.width - left - right)) / 2)
      .addScaledVector(up, (pixel * (top + bottom - pane.height)) / 2);
    camera.position.copy(controls.target).add(from);
    this.touched = true;
    controls.update();
    this.mark();
    this.viewer.set_dirty();
  }

  mark() {
    for (const [id, name] of Camera.BUTTONS) byId(id).ariaPressed = String(name === this.name && !this.touched);
  }

  resized() {
    const pane = paneBox();
    if (!this.touched) return this.look();
    this.viewer.set_3d_pane_size(pane.width, pane.height);
  }

  // Panels stand above the bar, which may have several rows.
  clearBar() {
    document.documentElement.style.setProperty("--bar", `${byId("bar").offsetHeight}px`);
  }

  // Turn about the point at which the camera looks [rad], or approach it by a factor.
  turn(across, up, nearer = 1) {
    const { camera, controls } = this.viewer;
    const from = new THREE.Spherical().setFromVector3(camera.position.clone().sub(controls.target));
    from.theta += across;
    from.phi = Math.min(Math.max(from.phi + up, 0.02), Math.PI - 0.02);
    from.radius /= nearer;
    camera.position.setFromSpherical(from).add(controls.target);
    this.touched = true;
    controls.update();
    this.mark();
    this.viewer.set_dirty();
  }

  look() {
    this.clearBar();
    const { viewer, data } = this;
    const camera = viewer.camera;
    const pane = paneBox();
    viewer.set_3d_pane_size(pane.width, pane.height);
    Object.assign(camera, { fov: 40, near: 0.01 * data.size, far: 60 * data.size });
    const view = (this.name === "work" && data.work) || data.view;
    const towards = world(view.towards_camera).normalize();
    const right = new THREE.Vector3(0, 1, 0).cross(towards).normalize();
    const up = towards.clone().cross(right);
    const middle = view.points.map(world).reduce((sum, p) => sum.add(p), new THREE.Vector3());
    middle.divideScalar(view.points.length);
    const points = view.points.map((point) => {
      const p = world(point).sub(middle);
      return [p.dot(right), p.dot(up), p.dot(towards)];
    });
    const { distance, at } = nearest(points, panels(pane), pane, camera.fov);
    const target = middle.addScaledVector(right, at[0]).addScaledVector(up, at[1]);
    camera.position.copy(target).addScaledVector(towards, distance);
    viewer.controls.target.copy(target);
    viewer.controls.update();
    viewer.set_dirty();
  }
}
