// Meshes as Three.js has them: geometry, colours and images.

const THREE = MeshCat.THREE;
const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
const floats = (text) => new Float32Array(bytes(text).buffer);

function geometry(mesh) {
  const made = new THREE.BufferGeometry();
  made.setAttribute("position", new THREE.BufferAttribute(floats(mesh.vertices), 3));
  const normals = new Int8Array(bytes(mesh.normals).buffer);
  made.setAttribute("normal", new THREE.BufferAttribute(normals, 3, true));
  const faces = bytes(mesh.faces).buffer;
  made.setIndex(new THREE.BufferAttribute(mesh.wide ? new Uint32Array(faces) : new Uint16Array(faces), 1));
  if (mesh.skins) made.setAttribute("uv", new THREE.BufferAttribute(floats(mesh.uv), 2));
  if (typeof mesh.colours === "string") {
    made.setAttribute("color", new THREE.BufferAttribute(bytes(mesh.colours), 3, true));
  }
  return made;
}

// Its own colours, or one tint for all of it
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

// Images on meshes, and a promise that all are there
function textures(addresses) {
  const pending = [];
  const images = addresses.map((address) => {
    if (!address) return null;
    const image = new Image();
    const texture = new THREE.Texture(image);
    texture.wrapS = texture.wrapT = THREE.RepeatWrapping;
    pending.push(new Promise((done, fail) => {
      image.onload = () => {
        texture.needsUpdate = true;
        done();
      };
      image.onerror = () => fail(new Error("an image of a mesh can't be shown"));
    }));
    image.src = address;
    return texture;
  });
  return { images, ready: Promise.all(pending) };
}

// A mesh in its colours; faces that have an image are shown with it instead.
function dressed({ mesh, geometry: form }, images) {
  const plain = material(mesh);
  if (!mesh.skins) return new THREE.Mesh(form, plain);
  const materials = [plain];
  let next = 0;
  const upTo = (end) => { if (end > next) form.addGroup(next, end - next, 0); };
  for (const [start, count, number] of [...mesh.skins].sort((a, b) => a[0] - b[0])) {
    upTo(3 * start);
    form.addGroup(3 * start, 3 * count, materials.length);
    next = 3 * (start + count);
    const skin = plain.clone();
    skin.vertexColors = false;
    skin.color = images[number] ? new THREE.Color(1, 1, 1) : new THREE.Color(0.75, 0.75, 0.75);
    skin.map = images[number];
    materials.push(skin);
  }
  upTo(form.index.count);
  return new THREE.Mesh(form, materials);
}

// The nearest surface alone, and behind the arm's where the two coincide
function translucent({ mesh, geometry: form }, opacity, tint, renderOrder) {
  const paint = material(mesh, { opacity, tint });
  Object.assign(paint, { transparent: true, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8 });
  const depth = Object.assign(paint.clone(), { colorWrite: false, depthWrite: true });
  const group = new THREE.Group();
  [depth, paint].forEach((one, pass) => {
    const part = new THREE.Mesh(form, one);
    part.renderOrder = renderOrder + pass;
    group.add(part);
  });
  return group;
}
