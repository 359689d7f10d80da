// The arm as nested groups, one per joint, and its motion.

const ROOT = ["Knotwork"];

function placeJoint(object, joint, q) {
  const turn = new THREE.Quaternion(...joint.quaternion);
  const axis = new THREE.Vector3(...joint.axis);
  object.position.set(...joint.origin);
  object.quaternion.copy(turn);
  if (joint.slides) object.position.add(axis.multiplyScalar(q).applyQuaternion(turn));
  else object.quaternion.multiply(new THREE.Quaternion().setFromAxisAngle(axis, q));
}

// Path in the scene of the parts that a joint carries; joint 0 is fixed.
function pathOf(joints, joint) {
  if (joint === 0) return [...ROOT, "arm"];
  return [...pathOf(joints, joints[joint - 1].parent), joints[joint - 1].name];
}

// Returns the meshes of each joint.
function addArm(viewer, data) {
  return data.shapes.map((parts, joint) => {
    const path = pathOf(data.joints, joint);
    if (joint > 0) placeJoint(viewer.scene_tree.find(path).object, data.joints[joint - 1], 0);
    const group = new THREE.Group();
    for (const mesh of parts) group.add(new THREE.Mesh(geometry(mesh), material(mesh)));
    viewer.set_object(path, group);
    return [...group.children];
  });
}

// The motion as Meshcat's animation, which shows the sampled frames without interpolation.
function animate(viewer, data) {
  const animations = tracks(data.joints, data.arm).map((track, i) => ({
    path: pathOf(data.joints, i + 1),
    clip: { fps: 1, name: "motion", tracks: [track] },
  }));
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
