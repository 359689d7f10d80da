// Background, floor and lamps around the arm, and the marks of the task.

// In light and dark mode: the background from top to bottom, lines of the grid, and the brightness of
// the surroundings relative to their own colours (red, green, blue)
const SKIES = {
  light: { above: [0.93, 0.95, 0.97], below: [0.78, 0.82, 0.87], lines: [0x7c8794, 0xb4bdc8], objects: [1, 1, 1] },
  dark: { above: [0.13, 0.15, 0.18], below: [0.07, 0.08, 0.1], lines: [0x55606c, 0x333c46], objects: [0.36, 0.38, 0.42] },
};
const night = matchMedia("(prefers-color-scheme: dark)");
const sky = () => SKIES[night.matches ? "dark" : "light"];

function addSurroundings(viewer, data) {
  const { above, below, lines } = sky();
  viewer.set_property(["Background"], "top_color", above);
  viewer.set_property(["Background"], "bottom_color", below);
  for (const name of ["Grid", "Axes"]) viewer.set_property([name], "visible", false);
  const cell = 10 ** Math.floor(Math.log10(data.size / 3));
  const cells = 2 * Math.ceil((1.4 * data.size) / cell);
  const grid = new THREE.GridHelper(cells * cell, cells, ...lines);
  grid.rotateX(Math.PI / 2);
  grid.position.z = data.floor - 0.002 * data.size;
  viewer.set_object([...ROOT, "grid"], grid);
}

// These lamps replace Meshcat's, at both sides of the viewer and behind. Meshcat can't exchange one
// lamp for another.
function addLamps(viewer, from) {
  for (const name of ["PointLightNegativeX", "PointLightPositiveX", "FillLight"]) {
    viewer.set_property(["Lights", name], "visible", false);
  }
  viewer.set_property(["Lights", "AmbientLight", "<object>"], "intensity", 0.46);
  const aside = new THREE.Vector3(-from[1], from[0], 0).normalize();
  const lamps = [
    [new THREE.Vector3(...from).addScaledVector(aside, -0.7).setZ(1.3), 0.5],
    [new THREE.Vector3(...from).addScaledVector(aside, 1.1).setZ(0.35), 0.24],
    [new THREE.Vector3(-from[0], -from[1], 0.9), 0.25],
  ];
  lamps.forEach(([direction, intensity], i) => {
    const lamp = new THREE.DirectionalLight(0xffffff, intensity);
    lamp.position.copy(direction.multiplyScalar(10));
    viewer.set_object([...ROOT, `lamp ${i + 1}`], lamp);
  });
}

// The material of a mesh; surroundings such as a floor or a table are dark in dark mode.
function paint({ mesh, lit, around }) {
  const paint = material(mesh, { lit });
  if (around) paint.color.multiply(new THREE.Color(...sky().objects));
  return paint;
}

// The path, waypoints, arrows and failures, and the tool, which moves with the joint that carries it.
// They replace those of the previous scene.
function addMarks(viewer, data, before) {
  (before?.meshes ?? []).forEach((item, number) => {
    item.object.geometry.dispose();
    viewer.delete_path(meshPath(before, item, number));
  });
  data.meshes.forEach((item, number) => {
    item.object = new THREE.Mesh(geometry(item.mesh), paint(item));
    viewer.set_object(meshPath(data, item, number), new THREE.Group().add(item.object));
  });
}

// Path of a mesh in the scene; one with a carrier moves with that joint.
function meshPath(data, { name, carrier }, number) {
  const path = carrier ? pathOf(data.joints, carrier) : ROOT;
  const alone = data.meshes.filter((other) => other.name === name).length === 1;
  return [...path, alone ? name : `${name} ${number}`];
}

// Show meshes that are present for a limited time only, such as held objects.
function showWhenThere(meshes, time) {
  for (const { object, between } of meshes) {
    if (!between) continue;
    const [start, end] = between;
    object.visible = (start === null || time >= start - 1e-6) && (end === null || time < end - 1e-6);
  }
}
