// Arms as nested groups, one a joint; their motion; faint copies of the arm at the waypoints.

const ROOT = ["Knotwork"];
const TINTS = [[70, 105, 225], [215, 125, 30], [20, 150, 110]]; // of arms after the first
const COPY = [105, 140, 185];

const armName = (arm, number) => (number > 0 ? `arm: ${arm.name}` : "arm");

function placeJoint(object, joint, q) {
  const turn = new THREE.Quaternion(...joint.quaternion);
  const axis = new THREE.Vector3(...joint.axis);
  object.position.set(...joint.origin);
  object.quaternion.copy(turn);
  if (joint.slides) object.position.add(axis.multiplyScalar(q).applyQuaternion(turn));
  else object.quaternion.multiply(new THREE.Quaternion().setFromAxisAngle(axis, q));
}

// Where the scene holds what a joint of an arm carries; joint 0 does not move.
function pathOf(joints, name, joint) {
  if (joint === 0) return [...ROOT, name];
  return [...pathOf(joints, name, joints[joint - 1].parent), joints[joint - 1].name];
}

function addArms(viewer, data, images) {
  const shapes = data.shapes.map((parts) => parts.map((mesh) => ({ mesh, geometry: geometry(mesh) })));
  const links = []; // of the first arm, by joint
  data.arms.forEach((arm, number) => shapes.forEach((parts, joint) => {
    const path = pathOf(data.joints, armName(arm, number), joint);
    const node = viewer.scene_tree.find(path);
    if (joint > 0) placeJoint(node.object, data.joints[joint - 1], 0);
    const group = new THREE.Group();
    for (const part of parts) {
      const object = number > 0
        ? translucent(part, 0.45, TINTS[(number - 1) % TINTS.length], 100 + 2 * number)
        : dressed(part, images);
      // Copies in front of the arm must not veil it: they are drawn only where this is not.
      if (number === 0) {
        Object.assign(object.material, { stencilWrite: true, stencilRef: 1, stencilZPass: THREE.ReplaceStencilOp });
      }
      group.add(object);
    }
    viewer.set_object(path, group);
    if (number === 0) links[joint] = [...group.children];
  }));
  return links;
}

// The motions as Meshcat's animation: frames are shown as sampled, none is made between two.
function animate(viewer, data) {
  const animations = data.arms.flatMap((arm, number) => tracks(data.joints, arm).map((track, i) => ({
    path: pathOf(data.joints, armName(arm, number), i + 1),
    clip: { fps: 1, name: "motion", tracks: [track] },
  })));
  viewer.set_animation(animations, { play: false, repetitions: 1 });
  for (const action of viewer.animator.actions) action.play();
  viewer.animator.seek(0);
}

function tracks(joints, arm) {
  const times = floats(arm.time);
  const q = floats(arm.position);
  return joints.map((joint, i) => {
    const object = new THREE.Object3D();
    const size = joint.slides ? 3 : 4;
    const values = new Float32Array(times.length * size);
    times.forEach((_, k) => {
      placeJoint(object, joint, q[k * joints.length + i]);
      (joint.slides ? object.position : object.quaternion).toArray(values, k * size);
    });
    return {
      name: joint.slides ? ".position" : ".quaternion",
      type: joint.slides ? "vector" : "quaternion",
      times,
      values,
      interpolation: THREE.InterpolateDiscrete,
    };
  });
}

// Copies of the arm where it stands at the waypoints.
class Copies {
  constructor(viewer, data) {
    Object.assign(this, { viewer, joints: data.joints, copies: [] });
    this.shapes = data.coarse.map((mesh) => mesh && { mesh, geometry: geometry(mesh) });
  }

  set(data) {
    this.ghosts = data.ghosts;
    this.positions = floats(data.arms[0].position);
    while (this.copies.length < this.ghosts.length) this.copies.push(this.another());
    this.ghosts.forEach((q, number) => this.joints.forEach((joint, i) => placeJoint(this.copies[number][i + 1], joint, q[i])));
  }

  // Those that stand where the arm is in a frame of the motion are not seen.
  update(frame) {
    const at = frame * this.joints.length;
    this.copies.forEach(([object], number) => {
      const q = this.ghosts[number] ?? [];
      object.visible = q.some((value, i) => Math.abs(value - this.positions[at + i]) > 0.02);
    });
  }

  // What each joint of one more copy carries
  another() {
    const number = this.copies.length;
    const groups = [new THREE.Group()];
    for (const { parent } of this.joints) {
      const group = new THREE.Group();
      groups[parent].add(group);
      groups.push(group);
    }
    this.shapes.forEach((shape, joint) => {
      if (!shape || joint === 0) return;
      const copy = translucent(shape, 0.2, COPY, 10 + 2 * number);
      for (const { material: paint } of copy.children) {
        Object.assign(paint, { stencilWrite: true, stencilRef: 1, stencilFunc: THREE.NotEqualStencilFunc });
      }
      groups[joint].add(copy);
    });
    this.viewer.set_object([...ROOT, "ghosts", `${number + 1}`], groups[0]);
    return groups;
  }
}
