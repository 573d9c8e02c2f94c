"use strict";
// Plays a robot's runs: poses from joint positions, links in the colour of torque or power, and numbers beside them.
// Needs robot.js and curves.js, fetches nothing. Other scripts take part through events on document:
// `irtwin:time` {detail: {time: seconds, source: element}} and `irtwin:run` {detail: {run: its place, source: element}}.
(function () {
  const { THREE } = MeshCat, { supported, makeViewer, build, shade, bytes, unpack } = irtwinRobot, { panel, extent } = irtwinCurves;
  const TRAIL = 20; // seconds of the flange's path that stay in sight

  // ---- a run: signals at even frames, straight lines between them

  function slope(values, step) {
    const last = values.length - 1;
    return values.map((_, i) => (values[Math.min(i + 1, last)] - values[Math.max(i - 1, 0)]) / (step * (i > 0 && i < last ? 2 : 1)));
  }

  function makeRun(data) {
    const energy = new Float32Array(bytes(data.energy)), last = energy.length - 1, q = data.q.map(unpack);
    const velocity = q.map((values) => slope(values, data.step)), torque = data.torque && data.torque.map(unpack);
    const at = (signal, time) => {
      const place = Math.min(Math.max((time - data.start) / data.step, 0), last), before = Math.min(Math.floor(place), Math.max(last - 1, 0));
      return signal[before] + (place - before) * (signal[Math.min(before + 1, last)] - signal[before]);
    };
    return {
      at, q, velocity, torque, energy, power: unpack(data.power), count: energy.length, step: data.step,
      start: data.start, end: data.start + last * data.step,
      jointPower: torque && torque.map((values, j) => values.map((value, i) => value * velocity[j][i])),
      positions: (time) => q.map((values) => at(values, time)),
    };
  }

  // ---- what links are coloured by: shares of the greatest, torque of each unit apart

  const COLOURS = {
    torque: { signal: "torque", unit: (joint) => (joint.unit === "m" ? "N" : "N m"), signed: false },
    power: { signal: "jointPower", unit: () => "W", signed: true },
  };

  function colouring(name, run, joints) {
    const { signal, unit, signed } = COLOURS[name], most = {};
    joints.forEach((joint, j) => {
      most[unit(joint)] = Math.max(most[unit(joint)] || 0, ...extent(run[signal][j]).map(Math.abs));
    });
    const share = (value, joint) => (most[unit(joint)] ? (signed ? value : Math.abs(value)) / most[unit(joint)] : 0) || 0;
    const greatest = Object.entries(most).map(([symbol, value]) => value.toPrecision(3).replace(/\.0+$/, "") + " " + symbol).join(", ");
    return {
      shares: (time) => joints.map((joint, j) => share(run.at(run[signal][j], time), joint)),
      low: signed ? "brakes −" + greatest : "0", high: signed ? greatest + " drives" : greatest, signed,
    };
  }

  function makeTrail(viewer, robot, run) {
    const points = [], colours = [], [low, high] = extent(run.power);
    for (let frame = 0; frame < run.count; frame++) {
      points.push(robot.flange(run.positions(run.start + frame * run.step)));
      const colour = shade(high > low ? (2 * (run.power[frame] - low)) / (high - low) - 1 : 0);
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

  // ---- the player

  function play(root) {
    const find = (name) => root.querySelector("." + name), still = find("is-still"), button = find("is-play");
    const data = JSON.parse(root.querySelector('script[type="application/json"]').textContent);
    const slider = find("is-slider"), choice = find("is-run"), colours = find("is-colour"), numbers = panel(root, data.joints);
    let viewer = null, robot = null, trail = () => {}, colour = null;
    let run = null, now = 0, playing = false, shown = 0;

    const tell = (name, detail) => document.dispatchEvent(new CustomEvent(name, { detail: { ...detail, source: root } }));

    function open(place) {
      run = makeRun(data.runs[place]);
      choice.value = place;
      slider.min = run.start;
      slider.max = run.end;
      numbers.open(run);
      if (viewer) trail = makeTrail(viewer, robot, run);
      for (const option of colours.options) option.disabled = option.value in COLOURS && !run[COLOURS[option.value].signal];
      if (colours.selectedOptions[0].disabled) colours.value = "own";
      paint();
      show(run.start, false);
    }

    function paint() {
      const legend = find("is-legend");
      colour = colours.value in COLOURS ? colouring(colours.value, run, data.joints) : null;
      legend.hidden = !colour;
      if (colour) {
        legend.classList.toggle("is-signed", colour.signed);
        find("is-least").textContent = colour.low;
        find("is-greatest").textContent = colour.high;
        find("is-coloured").textContent = colours.selectedOptions[0].textContent + ":";
      } else if (robot) robot.colour(null);
    }

    function show(time, told) {
      now = Math.min(Math.max(time, run.start), run.end);
      if (robot) {
        robot.pose(run.positions(now));
        if (colour) robot.colour(colour.shares(now));
        trail(now);
        viewer.render();
      }
      numbers.at(now);
      slider.value = now;
      if (told) tell("irtwin:time", { time: now });
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
      show(now + passed * Number(find("is-speed").value), true);
      if (now >= run.end) set(false);
      else requestAnimationFrame(step);
    }

    slider.addEventListener("input", () => { set(false); show(Number(slider.value), true); });
    button.addEventListener("click", () => set(!playing));
    colours.addEventListener("change", () => { paint(); show(now, false); });
    choice.addEventListener("change", () => {
      set(false);
      open(Number(choice.value));
      tell("irtwin:run", { run: Number(choice.value) });
      tell("irtwin:time", { time: now });
    });
    document.addEventListener("irtwin:time", ({ detail }) => {
      if (detail.source !== root && Number.isFinite(detail.time)) show(detail.time, false);
    });
    document.addEventListener("irtwin:run", ({ detail }) => {
      if (detail.source === root || !data.runs[detail.run]) return;
      set(false);
      open(detail.run);
      tell("irtwin:time", { time: now });
    });
    const keep = () => { if (viewer) still.src = viewer.capture_image(); };
    window.addEventListener("beforeprint", keep);

    if (supported()) {
      viewer = makeViewer(find("is-pane"), data.view);
      robot = build(viewer, data);
    } else {
      find("is-pane").innerHTML = "<p>This browser cannot draw the robot (no WebGL). Time, power, energy and joints still run.</p>";
    }
    root.irtwinScene = { viewer, show: (time) => show(time, true) };
    open(data.opens);
    if (viewer) viewer.set_3d_pane_size();
    keep();
  }

  document.querySelectorAll(".irtwin-scene").forEach((root) => { if (!root.irtwinScene) play(root); });
})();
