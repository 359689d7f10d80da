// The first camera: everything in view, and as large as the panels leave room for.

const byId = (id) => document.getElementById(id);
const paneBox = () => byId("scene").getBoundingClientRect();
const world = (point) => new THREE.Vector3(point[0], point[2], -point[1]);

// Boxes [left, top, right, bottom] of what lies over the scene, in the scene's own pixels
function panels(pane) {
  return [...document.querySelectorAll(".keep-clear, .dg.main")]
    .map((element) => element.getBoundingClientRect())
    .filter((box) => box.width > 0 && box.height > 0)
    .map((box) => [box.left - pane.left, box.top - pane.top, box.right - pane.left, box.bottom - pane.top]);
}

class Camera {
  constructor(viewer) {
    this.viewer = viewer;
    this.touched = false; // turned by hand: then the camera stays
    viewer.controls.addEventListener("start", () => { this.touched = true; });
    window.onload = null; // Meshcat's own would take the whole window
    window.addEventListener("resize", () => this.resized());
    byId("first-view").addEventListener("click", () => {
      this.touched = false;
      this.look();
    });
  }

  resized() {
    const pane = paneBox();
    if (this.touched) this.viewer.set_3d_pane_size(pane.width, pane.height);
    else this.look();
  }

  look() {
    const { viewer, data } = this;
    const camera = viewer.camera;
    const pane = paneBox();
    viewer.set_3d_pane_size(pane.width, pane.height);
    Object.assign(camera, { fov: 40, near: 0.01 * data.size, far: 60 * data.size });
    const towards = world(data.view.from).normalize();
    const right = new THREE.Vector3(0, 1, 0).cross(towards).normalize();
    const up = towards.clone().cross(right);
    const middle = data.view.points.map(world).reduce((sum, p) => sum.add(p), new THREE.Vector3());
    middle.divideScalar(data.view.points.length);
    const points = data.view.points.map((point) => {
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
