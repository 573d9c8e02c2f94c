"use strict";
// Builds a robot in MeshCat's viewer, poses it, and colours its links. Needs MeshCat, fetches nothing.
//   irtwinRobot.supported()           whether this browser draws in three dimensions
//   irtwinRobot.makeViewer(pane, view) a viewer in an element, its camera on `data.view`; `plain` draws fast, without
//                                     shadows and smooth edges
//   irtwinRobot.bySoftware()          whether the processor draws, which takes ten times as long
//   irtwinRobot.build(viewer, data, name) the robot of virtual/robot_data.py in it, one of each name, which has
//     .pose(q)         stand at the joint positions, rad or m
//     .colour(shares)  colour what each joint moves by a share of -1 to 1; null gives it its own colours again
//     .flange(q)       where the flange then is, m
//   irtwinRobot.shade(share)          the colour of a share: blue, grey, orange
//   irtwinRobot.bytes(text), .unpack(packed)  what packing.py put into base64: bytes, and samples, NaN where one is absent
window.irtwinRobot = (function () {
  const { Viewer, THREE } = MeshCat;
  const LOW = new THREE.Color("#0072b2"), MIDDLE = new THREE.Color("#c9ced3"), HIGH = new THREE.Color("#d55e00");

  const matrix = (values) => new THREE.Matrix4().fromArray(values);

  function supported() {
    const probe = document.createElement("canvas");
    return Boolean(probe.getContext("webgl2") || probe.getContext("webgl"));
  }

  function shade(share) {
    const bounded = Math.min(Math.max(share, -1), 1);
    return MIDDLE.clone().lerp(bounded < 0 ? LOW : HIGH, Math.abs(bounded));
  }

  // ---- the robot: one node a joint, its placement times its own motion

  function jointMatrix(joint, position) {
    const own = new THREE.Matrix4(), axis = new THREE.Vector3(...joint.axis);
    if (joint.unit === "m") own.setPosition(axis.multiplyScalar(position));
    else own.makeRotationAxis(axis, position);
    return matrix(joint.placement).multiply(own);
  }

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;

  function unpack({ data, offset, scale }) {
    return Float32Array.from(new Int16Array(bytes(data)), (level) => (level === -32768 ? NaN : offset + scale * level));
  }

  function triangles({ points, faces }) {
    const [x, y, z] = points.map(unpack);
    const made = new THREE.BufferGeometry(), places = new Float32Array(3 * x.length);
    x.forEach((_, i) => places.set([x[i], y[i], z[i]], 3 * i));
    made.setAttribute("position", new THREE.BufferAttribute(places, 3));
    made.setIndex(new THREE.BufferAttribute(new Uint32Array(bytes(faces)), 1));
    return made;
  }

  function geometry(part, meshes) {
    const [a, b, c] = part.size;
    if (part.kind === "mesh") return triangles(meshes[part.mesh]).scale(a, b, c);
    if (part.kind === "box") return new THREE.BoxGeometry(a, b, c);
    if (part.kind === "sphere") return new THREE.SphereGeometry(a, 36, 24);
    return new THREE.CylinderGeometry(a, a, b, 48).rotateX(Math.PI / 2); // three.js cylinders stand along y
  }

  function draw(part, meshes) {
    const [red, green, blue, opacity] = part.colour;
    const material = new THREE.MeshStandardMaterial({
      color: new THREE.Color(red, green, blue), roughness: 0.6, metalness: 0.05, transparent: opacity < 1, opacity: opacity,
    });
    if (part.kind === "mesh") Object.assign(material, { flatShading: true, side: THREE.DoubleSide }); // it may be inside out
    const mesh = new THREE.Mesh(geometry(part, meshes), material);
    mesh.castShadow = mesh.receiveShadow = true;
    return mesh;
  }

  function build(viewer, data, name = "robot") {
    const paths = [];
    data.joints.forEach((joint, index) => paths.push([...(joint.parent < 0 ? [name] : paths[joint.parent]), "joint " + index]));
    const drawn = data.parts.map((part, index) => {
      const mesh = draw(part, data.meshes), path = [...(part.joint < 0 ? [name] : paths[part.joint]), "part " + index];
      viewer.set_object(path, mesh);
      viewer.set_transform(path, part.placement);
      return { joint: part.joint, material: mesh.material, own: mesh.material.color.clone() };
    });
    return {
      pose: (q) => paths.forEach((path, j) => viewer.set_transform(path, jointMatrix(data.joints[j], q[j]).elements)),
      colour: (shares) => drawn.forEach(({ joint, material, own }) =>
        material.color.copy(shares === null ? own : joint < 0 ? MIDDLE : shade(shares[joint]))),
      flange: (q) => flangeAt(data, q),
    };
  }

  function flangeAt(data, q) {
    const placed = [];
    data.joints.forEach((joint, j) => {
      const own = jointMatrix(joint, q[j]);
      placed.push(joint.parent < 0 ? own : placed[joint.parent].clone().multiply(own));
    });
    const { joint, placement } = data.flange;
    const at = joint < 0 ? matrix(placement) : placed[joint].clone().multiply(matrix(placement));
    return new THREE.Vector3().setFromMatrixPosition(at);
  }

  // ---- the stage: light, floor, camera

  function dress(viewer, view) {
    const size = view.radius;
    viewer.set_property(["Axes"], "visible", false);
    viewer.set_property(["Background"], "top_color", [0.91, 0.94, 0.96]);
    viewer.set_property(["Background"], "bottom_color", [0.985, 0.99, 0.995]);
    ["PointLightNegativeX", "PointLightPositiveX", "SpotLight", "FillLight", "AmbientLight"].forEach((name) => viewer.set_property(["Lights", name], "visible", false));
    const sky = new THREE.HemisphereLight(0xffffff, 0xaab2ba, 0.62);
    sky.position.set(0, 0, 1);
    viewer.set_object(["Lights", "Sky"], sky);
    const sun = new THREE.DirectionalLight(0xffffff, 0.58);
    sun.position.set(1.6 * size, -1.1 * size, 3 * size);
    sun.castShadow = true;
    sun.shadow.mapSize.set(2048, 2048);
    Object.assign(sun.shadow.camera, { left: -2 * size, right: 2 * size, top: 2 * size, bottom: -2 * size, near: 0.1 * size, far: 8 * size });
    sun.shadow.bias = -0.0005;
    sun.shadow.normalBias = 0.01 * size;
    viewer.set_object(["Lights", "Sun"], sun);
    const fill = new THREE.DirectionalLight(0xffffff, 0.14);
    fill.position.set(-2 * size, 2 * size, 1.2 * size);
    viewer.set_object(["Lights", "Fill"], fill);
    const floor = new THREE.Mesh(new THREE.PlaneGeometry(8 * size, 8 * size), new THREE.ShadowMaterial({ opacity: 0.16 }));
    floor.receiveShadow = true;
    floor.position.z = view.floor - 0.001 * size;
    viewer.set_object(["Floor"], floor);
    const cell = size > 0.8 ? 0.25 : size > 0.3 ? 0.1 : 0.05, cells = 2 * Math.ceil((2.2 * size) / cell);
    const grid = new THREE.GridHelper(cells * cell, cells, 0xb8c3cc, 0xd6dde3);
    grid.rotateX(Math.PI / 2);
    grid.position.z = view.floor;
    viewer.set_object(["Grid"], grid);
    const [x, y, z] = view.centre, camera = viewer.camera, distance = 3.2 * size;
    camera.fov = 36;
    camera.near = 0.02 * size;
    camera.far = 40 * size;
    // MeshCat turns the camera's frame: its y is the robot's z, its z the robot's -y
    viewer.controls.target.set(x, z, -y);
    camera.position.set(x + 0.66 * distance, z + 0.33 * distance, -y + 0.67 * distance);
    viewer.controls.minDistance = 0.3 * size;
    viewer.controls.maxDistance = 8 * size;
  }

  function bySoftware() {
    const probe = document.createElement("canvas"), gl = probe.getContext("webgl2") || probe.getContext("webgl");
    const told = gl && gl.getExtension("WEBGL_debug_renderer_info");
    return Boolean(gl) && /swiftshader|llvmpipe|software/i.test(gl.getParameter(told ? told.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
  }

  function makeViewer(pane, view, plain = false) {
    const renderer = new THREE.WebGLRenderer({ antialias: !plain });
    renderer.shadowMap.enabled = !plain;
    renderer.shadowMap.type = THREE.PCFSoftShadowMap;
    pane.appendChild(renderer.domElement);
    const onload = window.onload; // MeshCat takes it for itself
    const viewer = new Viewer(pane, false, renderer);
    window.onload = onload;
    viewer.gui.domElement.remove();
    const resize = viewer.set_3d_pane_size.bind(viewer);
    viewer.set_3d_pane_size = () => {
      if (pane.clientWidth && pane.clientHeight) {
        resize(pane.clientWidth, pane.clientHeight);
        viewer.render();
      }
    };
    dress(viewer, view);
    new ResizeObserver(() => viewer.set_3d_pane_size()).observe(pane);
    let waiting = false;
    viewer.controls.addEventListener("change", () => {
      if (!waiting) requestAnimationFrame(() => { waiting = false; viewer.render(); });
      waiting = true;
    });
    // the wheel scrolls the page until the scene was clicked
    viewer.controls.enableZoom = false;
    pane.addEventListener("pointerdown", () => { viewer.controls.enableZoom = true; });
    pane.addEventListener("pointerleave", () => { viewer.controls.enableZoom = false; });
    return viewer;
  }
  return { supported, bySoftware, makeViewer, build, shade, bytes, unpack };
})();
