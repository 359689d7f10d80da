// Builds a scene in a Meshcat viewer from plain data, and adds controls, labels and a legend.
"use strict";

function showScene(data, options) {
  const THREE = MeshCat.THREE;
  const byId = (id) => document.getElementById(id);
  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const floats = (text) => new Float32Array(bytes(text).buffer);

  const viewer = new MeshCat.Viewer(byId("scene"));
  window.viewer = viewer;
  const root = ["Knotwork"];

  // Meshes

  function geometry(mesh) {
    const made = new THREE.BufferGeometry();
    made.setAttribute("position", new THREE.BufferAttribute(floats(mesh.vertices), 3));
    const normals = new Int8Array(bytes(mesh.normals).buffer);
    made.setAttribute("normal", new THREE.BufferAttribute(normals, 3, true));
    const faces = bytes(mesh.faces).buffer;
    const index = mesh.wide ? new Uint32Array(faces) : new Uint16Array(faces);
    made.setIndex(new THREE.BufferAttribute(index, 1));
    if (mesh.skins) made.setAttribute("uv", new THREE.BufferAttribute(floats(mesh.uv), 2));
    if (typeof mesh.colours === "string") {
      made.setAttribute("color", new THREE.BufferAttribute(bytes(mesh.colours), 3, true));
    }
    return made;
  }

  function material(mesh, lit, opacity, tint) {
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

  // Images on meshes; the page is ready when they are.

  const pending = [];
  const images = data.images.map((address) => {
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

  // The arm itself: where a mesh has images, its faces have them in place of colours.
  function dressed(shape) {
    const plain = material(shape.mesh, true, 1, null);
    if (!shape.mesh.skins) return plain;
    const skins = [...shape.mesh.skins].sort((a, b) => a[0] - b[0]);
    const all = shape.geometry.index.count;
    let next = 0;
    const materials = [plain];
    for (const [start, count, number] of skins) {
      if (3 * start > next) shape.geometry.addGroup(next, 3 * start - next, 0);
      shape.geometry.addGroup(3 * start, 3 * count, materials.length);
      next = 3 * (start + count);
      const skin = plain.clone();
      skin.vertexColors = false;
      skin.color = images[number] ? new THREE.Color(1, 1, 1) : new THREE.Color(0.75, 0.75, 0.75);
      skin.map = images[number];
      materials.push(skin);
    }
    if (next < all) shape.geometry.addGroup(next, all - next, 0);
    return materials;
  }

  const shapes = data.shapes.map((mesh) => mesh && { mesh, geometry: geometry(mesh) });

  const coarse = data.coarse.map((mesh) => mesh && { mesh, geometry: geometry(mesh) });

  // Arms: nested groups, one a joint

  function placeJoint(object, joint, q) {
    const turn = new THREE.Quaternion(...joint.quaternion);
    const axis = new THREE.Vector3(...joint.axis);
    object.position.set(...joint.origin);
    object.quaternion.copy(turn);
    if (joint.slides) object.position.add(axis.multiplyScalar(q).applyQuaternion(turn));
    else object.quaternion.multiply(new THREE.Quaternion().setFromAxisAngle(axis, q));
  }

  function pathOf(name, joint) {
    return joint === 0
      ? [...root, name]
      : [...pathOf(name, data.joints[joint - 1].parent), data.joints[joint - 1].name];
  }

  function addArm(arm, number) {
    const second = number > 0;
    const name = second ? `arm: ${arm.name}` : "arm";
    shapes.forEach((shape, joint) => {
      const path = pathOf(name, joint);
      const node = viewer.scene_tree.find(path);
      if (joint > 0) placeJoint(node.object, data.joints[joint - 1], 0);
      if (!shape) return;
      const tint = [[70, 105, 225], [215, 125, 30], [20, 150, 110]][(number + 2) % 3];
      const object = second
        ? translucent(shape, 0.45, tint, 100 + 2 * number)
        : new THREE.Mesh(shape.geometry, dressed(shape));
      for (const paint of second ? [] : [object.material].flat()) {
        // Copies in front of the arm must not veil it: see `ghost`.
        Object.assign(paint, { stencilWrite: true, stencilRef: 1, stencilZPass: THREE.ReplaceStencilOp });
      }
      viewer.set_object(path, object);
    });
  }

  // The nearest surface alone, and behind the arm's where the two coincide
  function translucent(shape, opacity, tint, renderOrder) {
    const paint = material(shape.mesh, true, opacity, tint);
    Object.assign(paint, { transparent: true, polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8 });
    const depth = paint.clone();
    Object.assign(depth, { colorWrite: false, depthWrite: true });
    const group = new THREE.Group();
    [depth, paint].forEach((one, pass) => {
      const mesh = new THREE.Mesh(shape.geometry, one);
      mesh.renderOrder = renderOrder + pass;
      group.add(mesh);
    });
    return group;
  }

  function ghost(q, number) {
    const groups = [new THREE.Group()];
    data.joints.forEach((joint, i) => {
      const group = new THREE.Group();
      placeJoint(group, joint, q[i]);
      groups[joint.parent].add(group);
      groups.push(group);
    });
    coarse.forEach((shape, joint) => {
      if (!shape || joint === 0) return;
      const copy = translucent(shape, 0.2, [105, 140, 185], 10 + 2 * number);
      for (const mesh of copy.children) {
        Object.assign(mesh.material, { stencilWrite: true, stencilRef: 1, stencilFunc: THREE.NotEqualStencilFunc });
      }
      groups[joint].add(copy);
    });
    return groups[0];
  }

  const ghosts = [];

  function addGhosts() {
    data.ghosts.forEach((q, i) => {
      const object = ghost(q, i);
      viewer.set_object([...root, "ghosts", `${i + 1}`], object);
      ghosts.push({ q, object });
    });
  }

  // Where the arm is, no copy of it is needed.
  function hideGhosts() {
    const count = data.joints.length;
    const at = frameAt(shownTime) * count;
    for (const { q, object } of ghosts) {
      object.visible = q.some((value, i) => Math.abs(value - positions[at + i]) > 0.02);
    }
  }

  // The motion as Meshcat's animation: frames are shown as sampled, none is made between two.

  function tracks(arm) {
    const times = floats(arm.time);
    const q = floats(arm.position);
    const count = data.joints.length;
    return data.joints.map((joint, i) => {
      const object = new THREE.Object3D();
      const size = joint.slides ? 3 : 4;
      const values = new Float32Array(times.length * size);
      times.forEach((_, k) => {
        placeJoint(object, joint, q[k * count + i]);
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

  function animate() {
    const animations = data.arms.flatMap((arm, number) => {
      const name = number > 0 ? `arm: ${arm.name}` : "arm";
      return tracks(arm).map((track, i) => ({
        path: pathOf(name, i + 1),
        clip: { fps: 1, name: "motion", tracks: [track] },
      }));
    });
    viewer.set_animation(animations, { play: false, repetitions: 1 });
    for (const action of viewer.animator.actions) action.play();
    viewer.animator.seek(0);
  }

  // Surroundings

  function surroundings() {
    viewer.set_property(["Background"], "top_color", [0.93, 0.95, 0.97]);
    viewer.set_property(["Background"], "bottom_color", [0.78, 0.82, 0.87]);
    for (const name of ["Grid", "Axes"]) viewer.set_property([name], "visible", false);
    const cell = 10 ** Math.floor(Math.log10(data.size / 3));
    const cells = 2 * Math.ceil((1.4 * data.size) / cell);
    const grid = new THREE.GridHelper(cells * cell, cells, 0x7c8794, 0xb4bdc8);
    grid.rotateX(Math.PI / 2);
    grid.position.z = data.floor - 0.002 * data.size;
    viewer.set_object([...root, "grid"], grid);
    for (const name of ["PointLightNegativeX", "PointLightPositiveX", "FillLight"]) {
      viewer.set_property(["Lights", name], "visible", false);
    }
    viewer.set_property(["Lights", "AmbientLight", "<object>"], "intensity", 0.46);
    const from = data.view.from;
    const aside = new THREE.Vector3(-from[1], from[0], 0).normalize();
    const lamps = [
      [new THREE.Vector3(...from).addScaledVector(aside, -0.7).setZ(1.3), 0.5],
      [new THREE.Vector3(...from).addScaledVector(aside, 1.1).setZ(0.35), 0.24],
      [new THREE.Vector3(-from[0], -from[1], 0.9), 0.25],
    ];
    lamps.forEach(([direction, intensity], i) => {
      const lamp = new THREE.DirectionalLight(0xffffff, intensity);
      lamp.position.copy(direction.multiplyScalar(10));
      viewer.set_object([...root, `lamp ${i + 1}`], lamp);
    });
  }

  // The first camera: everything in view, and as large as the panels leave room for.

  const world = (point) => new THREE.Vector3(point[0], point[2], -point[1]);

  // Boxes [left, top, right, bottom] of what lies over the scene, in the scene's own pixels
  function panels(pane) {
    return [...document.querySelectorAll(".keep-clear, .dg.main")]
      .map((element) => element.getBoundingClientRect())
      .filter((box) => box.width > 0 && box.height > 0)
      .map((box) => [box.left - pane.left, box.top - pane.top, box.right - pane.left, box.bottom - pane.top]);
  }

  let touched = false; // turned by hand: then the camera stays

  function resized() {
    const pane = byId("scene").getBoundingClientRect();
    if (touched) viewer.set_3d_pane_size(pane.width, pane.height);
    else look();
  }

  function look() {
    const camera = viewer.camera;
    const pane = byId("scene").getBoundingClientRect();
    viewer.set_3d_pane_size(pane.width, pane.height);
    camera.fov = 40;
    camera.near = 0.01 * data.size;
    camera.far = 60 * data.size;
    const towards = world(data.view.from).normalize();
    const right = new THREE.Vector3(0, 1, 0).cross(towards).normalize();
    const up = towards.clone().cross(right);
    const middle = data.view.points.map(world).reduce((sum, p) => sum.add(p), new THREE.Vector3());
    middle.divideScalar(data.view.points.length);
    const points = data.view.points.map((point) => {
      const p = world(point).sub(middle);
      return [p.dot(right), p.dot(up), p.dot(towards)];
    });
    const taken = panels(pane);
    const choices = parts(taken, pane).map((part) => fit(points, part, pane, camera.fov));
    const free = choices.filter(({ outline }) => !taken.some((box) => touches(outline, box)));
    const whole = fit(points, [0, 0, pane.width, pane.height], pane, camera.fov);
    const { distance, at } = free.reduce((best, one) => (one.distance < best.distance ? one : best), free[0] || whole);
    const target = middle.addScaledVector(right, at[0]).addScaledVector(up, at[1]);
    camera.position.copy(target).addScaledVector(towards, distance);
    viewer.controls.target.copy(target);
    viewer.controls.update();
    viewer.set_dirty();
  }

  // Labels: words beside their points, none over another

  const layer = byId("labels");
  const lines = byId("leaders");
  const labels = data.labels.map((label) => {
    const box = document.createElement("div");
    box.className = `label ${label.kind}`;
    box.textContent = label.text;
    box.title = label.detail;
    layer.appendChild(box);
    const line = document.createElementNS("http://www.w3.org/2000/svg", "line");
    line.setAttribute("class", label.kind);
    lines.appendChild(line);
    return { box, line, point: world(label.at), kind: label.kind, place: 0 };
  });
  const order = { miss: 0, waypoint: 1, frame: 2 };
  labels.sort((a, b) => order[a.kind] - order[b.kind]);
  const places = [];
  for (const radius of [16, 30, 48, 70, 96, 126, 165, 210]) {
    for (let k = 0; k < 12; k++) {
      const angle = ((k % 2 ? -1 : 1) * Math.ceil(k / 2) * Math.PI) / 6 - Math.PI / 3;
      places.push([radius * Math.cos(angle), radius * Math.sin(angle)]);
    }
  }

  let seenFrom = "";

  function placeLabels() {
    const camera = viewer.camera;
    camera.updateMatrixWorld();
    const pane = byId("scene").getBoundingClientRect();
    const size = `${pane.width} ${pane.height}`;
    const view = [size, ...camera.matrixWorld.elements, ...camera.projectionMatrix.elements].join();
    if (view === seenFrom) return;
    // While the scene turns, words stay on their side of a point; in another window they start anew.
    if (!seenFrom.startsWith(`${size},`)) for (const label of labels) label.place = -1;
    seenFrom = view;
    const taken = panels(pane);
    const free = (box) =>
      box[0] >= 2 && box[1] >= 2 && box[2] <= pane.width - 2 && box[3] <= pane.height - 2 &&
      taken.every((t) => box[2] < t[0] || box[0] > t[2] || box[3] < t[1] || box[1] > t[3]);
    for (const label of labels) {
      const { width, height } = label.box.getBoundingClientRect(); // on a phone words are smaller
      Object.assign(label, { width, height });
    }
    const spots = labels.map((label) => {
      const p = label.point.clone().project(viewer.camera);
      const visible = p.z < 1 && Math.abs(p.x) < 1 && Math.abs(p.y) < 1;
      const [x, y] = [((p.x + 1) / 2) * pane.width, ((1 - p.y) / 2) * pane.height];
      if (visible) taken.push([x - 4, y - 4, x + 4, y + 4]);
      return { label, visible, x, y };
    });
    for (const { label, visible, x, y } of spots) {
      const at = (place) => {
        const [dx, dy] = places[place];
        const left = x + dx - (dx < 0 ? label.width : 0);
        const top = y + dy - label.height / 2;
        return [left, top, left + label.width, top + label.height];
      };
      // Moved into the pane
      const inside = (place) => {
        const [left, top] = at(place);
        const [x0, y0] = [Math.min(left, pane.width - label.width - 2), Math.min(top, pane.height - label.height - 2)];
        return [Math.max(x0, 2), Math.max(y0, 2), Math.max(x0, 2) + label.width, Math.max(y0, 2) + label.height];
      };
      const covered = (box) => taken.reduce((sum, t) => sum
        + Math.max(Math.min(box[2], t[2]) - Math.max(box[0], t[0]), 0)
        * Math.max(Math.min(box[3], t[3]) - Math.max(box[1], t[1]), 0), 0);
      const choices = visible ? [label.place, ...places.keys()].filter((choice) => choice >= 0) : [];
      let place = choices.find((choice) => free(at(choice)));
      // What fails is said even where there is no free place for it: where it covers the least.
      if (place === undefined && label.kind === "miss" && visible) {
        const costs = choices.map((choice) => covered(inside(choice)));
        place = choices[costs.indexOf(Math.min(...costs))];
      }
      const shown = place !== undefined;
      label.place = shown ? place : -1;
      label.box.style.visibility = label.line.style.visibility = shown ? "visible" : "hidden";
      if (!shown) continue;
      const box = inside(place);
      taken.push([box[0] - 2, box[1] - 1, box[2] + 2, box[3] + 1]);
      label.box.style.transform = `translate(${box[0]}px, ${box[1]}px)`;
      const edge = places[place][0] < 0 ? box[2] : box[0];
      label.line.setAttribute("x1", x);
      label.line.setAttribute("y1", y);
      label.line.setAttribute("x2", edge);
      label.line.setAttribute("y2", (box[1] + box[3]) / 2);
    }
  }

  // A still picture: what is seen, with its labels and legend, for paper; of one size everywhere

  function still() {
    const body = document.body;
    body.classList.add("still");
    const fine = 2;
    const before = viewer.renderer.getPixelRatio();
    viewer.renderer.setPixelRatio(fine);
    resized();
    viewer.render();
    placeLabels();
    const pane = byId("scene").getBoundingClientRect();
    const said = layer.style.display === "none" ? [] : labels.filter(({ box }) => box.style.visibility === "visible");
    const colours = data.legend.colours || [];
    const address = pictureWithWords(viewer.renderer.domElement, pane, said, byId("legend"), colours, fine);
    body.classList.remove("still");
    viewer.renderer.setPixelRatio(before);
    resized();
    viewer.render();
    placeLabels();
    return address;
  }

  // Controls

  const animator = viewer.animator;
  const play = byId("play");
  const scrub = byId("scrub");
  const clock = byId("clock");
  const start = data.arms[0].start;
  const frameTimes = floats(data.arms[0].time);
  const positions = floats(data.arms[0].position);
  const speeds = data.arms[0].speed ? floats(data.arms[0].speed) : null;

  function frameAt(time) {
    let [low, high] = [0, frameTimes.length - 1];
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (frameTimes[middle] <= time) low = middle;
      else high = middle - 1;
    }
    return low;
  }

  let shownTime = 0; // after its end, Meshcat's own clock goes back to 0 while the end is shown
  let ran = false;

  function seek(time) {
    shownTime = Math.min(Math.max(time, 0), animator.duration);
    if (animator.playing) animator.pause();
    for (const action of animator.actions) {
      action.paused = false;
      action.play();
    }
    animator.seek(shownTime);
    animator.time = shownTime;
    ran = false;
  }

  function toggle() {
    if (animator.playing) {
      animator.pause();
      ran = false;
    } else {
      seek(shownTime >= animator.duration - 1e-6 ? 0 : shownTime);
      animator.play();
    }
  }

  play.addEventListener("click", toggle);
  scrub.max = animator.duration || 1;
  scrub.addEventListener("input", () => seek(Number(scrub.value)));
  byId("rate").addEventListener("change", (event) => {
    animator.mixer.timeScale = Number(event.target.value);
  });
  document.addEventListener("keydown", (event) => {
    if (event.target.closest("input, select, button, .dg")) return;
    const step = { ArrowLeft: -1, ArrowRight: 1 }[event.key];
    if (event.key === " ") toggle();
    else if (step) {
      const next = frameAt(shownTime) + step;
      seek(frameTimes[Math.min(Math.max(next, 0), frameTimes.length - 1)]);
    } else return;
    event.preventDefault();
  });

  function controls() {
    if (animator.playing) {
      shownTime = animator.time;
      ran = true;
    } else if (ran) {
      // It has come to its end by itself: Meshcat shows the last frame.
      if (animator.time < 1e-9 || animator.time >= animator.duration) shownTime = animator.duration;
      ran = false;
    } else if (animator.time !== shownTime && animator.time > 0) {
      shownTime = animator.time; // moved by Meshcat's own controls
    }
    // Only what has changed is written: a scene at rest costs no drawing.
    if (document.activeElement !== scrub || animator.playing) {
      if (Math.abs(scrub.value - shownTime) > 1e-6) scrub.value = shownTime;
    }
    const speed = speeds ? `  ${(1000 * speeds[frameAt(shownTime)]).toFixed(0)} mm/s` : "";
    say(clock, `${(start + shownTime).toFixed(2)} s${speed}`);
    say(play, animator.playing ? "❚❚" : "▶");
    const label = animator.playing ? "pause" : "play";
    if (play.getAttribute("aria-label") !== label) play.setAttribute("aria-label", label);
  }

  function say(element, text) {
    if (element.textContent !== text) element.textContent = text;
  }

  function switches() {
    const rows = { labels: null };
    for (const name of ["ghosts", ...data.things.map((thing) => thing.name)]) {
      if (name !== "tool") rows[name] = [...root, name];
    }
    data.arms.slice(1).forEach((arm) => { rows[`arm: ${arm.name}`] = [...root, `arm: ${arm.name}`]; });
    for (const [name, path] of Object.entries(rows)) {
      const row = document.createElement("label");
      const box = document.createElement("input");
      box.type = "checkbox";
      box.checked = !(name === "ghosts" && options.ghosts === false);
      box.name = name;
      row.append(box, ` ${name}`);
      byId("switches").appendChild(row);
      const change = () => {
        if (path) viewer.set_property(path, "visible", box.checked);
        else for (const layerOf of [layer, lines]) layerOf.style.display = box.checked ? "" : "none";
        viewer.set_dirty();
      };
      box.addEventListener("change", change);
      if (!box.checked) change();
    }
  }

  // Put together

  surroundings();
  data.arms.forEach(addArm);
  addGhosts();
  for (const thing of data.things) {
    const path = thing.carrier === undefined
      ? [...root, thing.name] : [...pathOf("arm", thing.carrier), thing.name];
    const paint = material(thing.mesh, thing.lit, 1, null);
    viewer.set_object(path, new THREE.Mesh(geometry(thing.mesh), paint));
  }
  animate();
  switches();
  look();
  viewer.controls.addEventListener("start", () => { touched = true; });
  window.onload = null; // Meshcat's own would take the whole window
  window.addEventListener("resize", resized);
  byId("first-view").addEventListener("click", () => { touched = false; look(); });
  const asked = /[#&]t=([\d.]+)/.exec(location.hash);
  if (asked) seek(Number(asked[1]) - start);
  else if (options.autoplay && !/paused/.test(location.hash)) animator.play();

  (function tick() {
    controls();
    placeLabels();
    hideGhosts();
    requestAnimationFrame(tick);
  })();

  // What the page around it, and tests, may ask for
  window.knotwork = {
    seek: (time) => seek(time - start),
    time: () => start + shownTime,
    duration: animator.duration,
    play: () => { if (!animator.playing) toggle(); },
    pause: () => { if (animator.playing) toggle(); },
    picture: () => viewer.capture_image(),
  };
  placeLabels();
  hideGhosts();
  return Promise.all(pending).then(() => {
    viewer.set_dirty();
    viewer.render();
    document.documentElement.dataset.ready = "true";
    if (window.parent === window) return;
    const show = () => window.parent.postMessage({ knotwork: still() }, "*");
    show();
    // The picture on paper is as the scene was turned, and as wide.
    viewer.controls.addEventListener("end", show);
    let waiting = 0;
    window.addEventListener("resize", () => {
      clearTimeout(waiting);
      waiting = setTimeout(show, 300);
    });
  });
}
