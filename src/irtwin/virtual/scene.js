"use strict";
// Plays a robot's run: poses from joint positions, and beside them time, power and energy. Needs robot.js, fetches nothing.
// Other scripts take part through `irtwin:time` events on document: {detail: {time: seconds, source: element}}.
(function () {
  const { THREE } = MeshCat, { supported, makeViewer, build, shade } = irtwinRobot;
  const TRAIL = 20; // seconds of the flange's path that stay in sight
  const SVG = "http://www.w3.org/2000/svg";

  function floats(text) {
    const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
    return new Float32Array(bytes.buffer);
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

  function buildTrail(viewer, robot, run, scale) {
    const points = [], colours = [];
    for (let frame = 0; frame < run.count; frame++) {
      points.push(robot.flange(run.positions(run.start + frame * run.step)));
      const colour = shade(2 * scale(run.power[frame]) - 1);
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
      const robot = build(viewer, data);
      pose = robot.pose;
      trail = buildTrail(viewer, robot, run, (watt) => (high > low ? (watt - low) / (high - low) : 0.5));
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
