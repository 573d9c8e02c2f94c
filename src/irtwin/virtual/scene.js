"use strict";
// Plays a robot's run: poses from joint positions, and beside them time, power and energy. Needs MeshCat, fetches nothing.
// Other scripts take part through `irtwin:time` events on document: {detail: {time: seconds, source: element}}.
(function () {
  const { Viewer, THREE } = MeshCat;
  const LOW = new THREE.Color("#0072b2"), MIDDLE = new THREE.Color("#c9ced3"), HIGH = new THREE.Color("#d55e00");
  const TRAIL = 20; // seconds of the flange's path that stay in sight
  const SVG = "http://www.w3.org/2000/svg";

  function floats(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
  }

  const matrix = (values) => new THREE.Matrix4().fromArray(values);

  function supported() {
    const probe = document.createElement("canvas");
    return Boolean(probe.getContext("webgl2") || probe.getContext("webgl"));
  }

  // ---- the run: signals at even frames, straight lines between them

  function makeRun(data) {
    const q = floats(data.q), energy = floats(data.energy), power = floats(data.power);
    const count = energy.length, joints = data.joints.length, last = count - 1;
    const at = (signal, time, width, column) => {
      const place = Math.min(Math.max((time - data.start) / data.step, 0), last);
      const before = Math.min(Math.floor(place), Math.max(last - 1, 0)), part = place - before;
      const a = signal[before * width + column], b = signal[Math.min(before + 1, last) * width + column];
      return a + part * (b - a);
    };
    return {
      count, energy, power, start: data.start, end: data.start + last * data.step, step: data.step,
      positions: (time) => Array.from({ length: joints }, (_, j) => at(q, time, joints, j)),
      energyAt: (time) => at(energy, time, 1, 0),
      powerAt: (time) => at(power, time, 1, 0),
    };
  }

  // ---- the robot: one node a joint, its placement times its own motion

  function jointMatrix(joint, position) {
    const own = new THREE.Matrix4(), axis = new THREE.Vector3(...joint.axis);
    if (joint.unit === "m") own.setPosition(axis.multiplyScalar(position));
    else own.makeRotationAxis(axis, position);
    return matrix(joint.placement).multiply(own);
  }

  function geometry(part) {
    const [a, b, c] = part.size;
    if (part.kind === "box") return new THREE.BoxGeometry(a, b, c);
    if (part.kind === "sphere") return new THREE.SphereGeometry(a, 36, 24);
    return new THREE.CylinderGeometry(a, a, b, 48).rotateX(Math.PI / 2); // three.js cylinders stand along y
  }

  function buildRobot(viewer, data) {
    const paths = [];
    data.joints.forEach((joint, index) => paths.push([...(joint.parent < 0 ? ["robot"] : paths[joint.parent]), "joint " + index]));
    data.parts.forEach((part, index) => {
      const [red, green, blue, alpha] = part.colour;
      const material = new THREE.MeshStandardMaterial({
        color: new THREE.Color(red, green, blue), roughness: 0.6, metalness: 0.05, transparent: alpha < 1, opacity: alpha,
      });
      const mesh = new THREE.Mesh(geometry(part), material);
      mesh.castShadow = mesh.receiveShadow = true;
      const path = [...(part.joint < 0 ? ["robot"] : paths[part.joint]), "part " + index];
      viewer.set_object(path, mesh);
      viewer.set_transform(path, part.placement);
    });
    return (positions) => paths.forEach((path, j) => viewer.set_transform(path, jointMatrix(data.joints[j], positions[j]).elements));
  }

  function flangeAt(data, positions) {
    const placed = [];
    data.joints.forEach((joint, j) => {
      const own = jointMatrix(joint, positions[j]);
      placed.push(joint.parent < 0 ? own : placed[joint.parent].clone().multiply(own));
    });
    return new THREE.Vector3().setFromMatrixPosition(placed[data.flange.joint].clone().multiply(matrix(data.flange.placement)));
  }

  function buildTrail(viewer, data, run, scale) {
    const points = [], colours = [];
    for (let frame = 0; frame < run.count; frame++) {
      points.push(flangeAt(data, run.positions(run.start + frame * run.step)));
      const share = scale(run.power[frame]);
      const colour = share < 0.5 ? LOW.clone().lerp(MIDDLE, 2 * share) : MIDDLE.clone().lerp(HIGH, 2 * share - 1);
      colours.push(colour.r, colour.g, colour.b);
    }
    const line = new THREE.BufferGeometry().setFromPoints(points);
    line.setAttribute("color", new THREE.Float32BufferAttribute(colours, 3));
    // a dot a frame, as lines are one pixel wide: close together where the flange is slow
    viewer.set_object(["trail", "line"], new THREE.Line(line, new THREE.LineBasicMaterial({ vertexColors: true })));
    viewer.set_object(["trail", "dots"], new THREE.Points(line, new THREE.PointsMaterial({ vertexColors: true, size: 3.5, sizeAttenuation: false })));
    return (time) => {
      const frames = 1 + Math.floor((time - run.start) / run.step + 1e-6), shown = Math.min(frames, Math.ceil(TRAIL / run.step));
      line.setDrawRange(frames - shown, shown);
    };
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

  function makeViewer(pane, view) {
    const renderer = new THREE.WebGLRenderer({ antialias: true });
    renderer.shadowMap.enabled = true;
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

  // ---- the numbers beside it

  function curve(svg, values, run) {
    let low = Math.min(0, ...sampled(values)), high = Math.max(...sampled(values));
    if (high <= low) high = low + 1;
    const x = (index) => (100 * index) / Math.max(values.length - 1, 1), y = (value) => 38 - (36 * (value - low)) / (high - low);
    const stride = Math.ceil(values.length / 1500);
    const path = (end) => {
      let text = "";
      for (let i = 0; i < end; i += stride) text += (i ? "L" : "M") + x(i).toFixed(2) + " " + y(values[i]).toFixed(2);
      return text;
    };
    const add = (name, type, attributes) => {
      const element = document.createElementNS(SVG, name);
      element.setAttribute("class", type);
      Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
      return svg.appendChild(element);
    };
    svg.setAttribute("viewBox", "0 0 100 40");
    if (low < 0) add("line", "is-zero", { x1: 0, x2: 100, y1: y(0), y2: y(0) });
    add("path", "is-all", { d: path(values.length) });
    const past = add("path", "is-past", {}), cursor = add("line", "is-now", { y1: 0, y2: 40 });
    return (time) => {
      const index = (time - run.start) / run.step;
      past.setAttribute("d", path(Math.floor(index) + 1));
      cursor.setAttribute("x1", x(index));
      cursor.setAttribute("x2", x(index));
    };
  }

  function sampled(values) {
    const stride = Math.ceil(values.length / 20000);
    return values.filter((_, index) => index % stride === 0);
  }

  function jointRows(body, joints) {
    const rows = joints.map((joint) => {
      const row = body.insertRow(), name = document.createElement("th"), range = document.createElement("div");
      name.scope = "row";
      name.textContent = name.title = joint.name;
      row.appendChild(name);
      range.className = "is-range";
      range.appendChild(document.createElement("i"));
      row.insertCell().appendChild(range);
      return { dot: range.firstChild, value: row.insertCell() };
    });
    return (positions) => positions.forEach((position, j) => {
      const { lower, upper, unit } = joints[j];
      rows[j].value.textContent = unit === "m" ? position.toFixed(3) + " m" : ((180 / Math.PI) * position).toFixed(1) + "°";
      rows[j].dot.classList.toggle("is-outside", position < lower || position > upper);
      rows[j].dot.style.left = Math.min(Math.max((100 * (position - lower)) / (upper - lower), 0), 100) + "%";
    });
  }

  function unitOf(joules) {
    if (joules >= 1e6) return { unit: "MJ", divide: 1e6, digits: 3 };
    if (joules >= 1e4) return { unit: "kJ", divide: 1e3, digits: 2 };
    return { unit: "J", divide: 1, digits: joules >= 100 ? 0 : 2 };
  }

  function panel(root, data, run) {
    const find = (name) => root.querySelector("." + name);
    const most = Math.max(...sampled(run.energy).map(Math.abs)), energy = unitOf(most);
    const written = (joules) => (joules / energy.divide).toFixed(energy.digits);
    find("is-energy-unit").textContent = energy.unit;
    find("is-energy-range").textContent = "0 to " + written(run.energy[run.count - 1]) + " " + energy.unit;
    const power = sampled(run.power), low = Math.min(...power), high = Math.max(...power);
    find("is-power-range").textContent = low.toFixed(0) + " to " + high.toFixed(0) + " W";
    find("is-low").textContent = low.toFixed(0) + " W";
    find("is-high").textContent = high.toFixed(0) + " W";
    const curves = [curve(find("is-power-curve"), run.power, run), curve(find("is-energy-curve"), run.energy, run)];
    const rows = jointRows(find("is-joints").tBodies[0], data.joints), bar = find("is-bar").firstElementChild;
    return (time, positions) => {
      find("is-time").value = time.toFixed(1);
      find("is-power").value = run.powerAt(time).toFixed(0);
      find("is-energy").value = written(run.energyAt(time));
      bar.style.transform = "scaleX(" + Math.min(Math.max(run.energyAt(time) / (most || 1), 0), 1) + ")";
      curves.forEach((draw) => draw(time));
      rows(positions);
    };
  }

  // ---- the player

  function play(root) {
    const data = JSON.parse(root.querySelector('script[type="application/json"]').textContent);
    const run = makeRun(data), pane = root.querySelector(".is-pane"), still = root.querySelector(".is-still");
    const button = root.querySelector(".is-play"), slider = root.querySelector(".is-slider"), speed = root.querySelector(".is-speed");
    const numbers = panel(root, data, run);
    let viewer = null, pose = () => {}, trail = () => {};
    if (supported()) {
      const power = sampled(run.power), low = Math.min(...power), high = Math.max(...power);
      viewer = makeViewer(pane, data.view);
      pose = buildRobot(viewer, data);
      trail = buildTrail(viewer, data, run, (watt) => (high > low ? (watt - low) / (high - low) : 0.5));
    } else {
      pane.innerHTML = "<p>This browser cannot draw the robot (no WebGL). Time, power, energy and joints still run.</p>";
    }
    let now = run.start, playing = false, shown = 0;

    function show(time, tell) {
      now = Math.min(Math.max(time, run.start), run.end);
      const positions = run.positions(now);
      pose(positions);
      trail(now);
      numbers(now, positions);
      slider.value = now;
      if (viewer) viewer.render();
      if (tell) document.dispatchEvent(new CustomEvent("irtwin:time", { detail: { time: now, source: root } }));
    }

    function set(on) {
      playing = on;
      button.classList.toggle("is-playing", on);
      button.setAttribute("aria-label", on ? "Pause" : "Play");
      if (on) {
        if (now >= run.end) show(run.start, true);
        shown = performance.now();
        requestAnimationFrame(step);
      }
    }

    function step(stamp) {
      if (!playing) return;
      const passed = Math.max(stamp - shown, 0) / 1000;
      shown = Math.max(stamp, shown);
      show(now + passed * Number(speed.value), true);
      if (now >= run.end) set(false);
      else requestAnimationFrame(step);
    }

    slider.min = run.start;
    slider.max = run.end;
    slider.addEventListener("input", () => { set(false); show(Number(slider.value), true); });
    button.addEventListener("click", () => set(!playing));
    document.addEventListener("irtwin:time", (event) => {
      if (event.detail.source !== root && Number.isFinite(event.detail.time)) show(event.detail.time, false);
    });
    const keep = () => { if (viewer) still.src = viewer.capture_image(); };
    window.addEventListener("beforeprint", keep);
    root.irtwinScene = { viewer, show: (time) => show(time, true) };
    if (viewer) viewer.set_3d_pane_size();
    show(run.start, false);
    keep();
  }

  document.querySelectorAll(".irtwin-scene").forEach((root) => { if (!root.irtwinScene) play(root); });
})();
