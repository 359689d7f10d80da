// Meshes of Three.js: geometry and colours.

const THREE = MeshCat.THREE;
function bytes(text) {
  const letters = atob(text);
  const made = new Uint8Array(letters.length);
  for (let i = 0; i < letters.length; i++) made[i] = letters.charCodeAt(i);
  return made;
}
const floats = (text) => new Float32Array(bytes(text).buffer);

function geometry(mesh) {
  const made = new THREE.BufferGeometry();
  made.setAttribute("position", new THREE.BufferAttribute(floats(mesh.vertices), 3));
  const normals = new Int8Array(bytes(mesh.normals).buffer);
  made.setAttribute("normal", new THREE.BufferAttribute(normals, 3, true));
  const faces = bytes(mesh.faces).buffer;
  made.setIndex(new THREE.BufferAttribute(mesh.wide ? new Uint32Array(faces) : new Uint16Array(faces), 1));
  if (typeof mesh.colours === "string") {
    made.setAttribute("color", new THREE.BufferAttribute(bytes(mesh.colours), 3, true));
  }
  return made;
}

// Its own colours, or one tint
function material(mesh, { lit = true, opacity = 1, tint = null } = {}) {
  const varied = typeof mesh.colours === "string" && !tint;
  const colour = varied ? [255, 255, 255] : tint || mesh.colours;
  const settings = {
    color: new THREE.Color(...colour.map((part) => part / 255)),
    vertexColors: varied,
    opacity: opacity * mesh.opacity,
    transparent: opacity * mesh.opacity < 1,
    depthWrite: opacity * mesh.opacity > 0.3,
  };
  if (!lit) return new THREE.MeshBasicMaterial(settings);
  return new THREE.MeshPhongMaterial({ ...settings, specular: 0x1c1c1c, shininess: 25 });
}

// Only the nearest surface is drawn, and behind the arm's where both coincide
function translucent(form, mesh, opacity, tint, renderOrder) {
  const paint = material(mesh, { opacity, tint });
  Object.assign(paint, { transparent: true, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8 });
  const depth = Object.assign(paint.clone(), { colorWrite: false, depthWrite: true });
  const group = new THREE.Group();
  [depth, paint].forEach((layer, pass) => {
    const part = new THREE.Mesh(form, layer);
    part.renderOrder = renderOrder + pass;
    group.add(part);
  });
  return group;
}
