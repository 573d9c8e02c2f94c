"use strict";
// The numbers beside the robot: time, power and energy, and a curve of each joint, with a cursor that follows the time.
//   irtwinCurves.panel(root, joints)  in the elements of scene.html.jinja, which has
//     .open(run)  show a run of scene.js
//     .at(time)   move to a moment of it, s
window.irtwinCurves = (function () {
  const SVG = "http://www.w3.org/2000/svg", POINTS = 600; // of a curve
  const DEGREES = { unit: "°", factor: 180 / Math.PI, digits: 1 }, METRES = { unit: "m", factor: 1, digits: 3 };
  const QUANTITIES = {
    position: { signal: "q", turning: DEGREES, sliding: METRES },
    velocity: { signal: "velocity", turning: { ...DEGREES, unit: "°/s" }, sliding: { ...METRES, unit: "m/s" } },
    torque: { signal: "torque", turning: { unit: "N m", factor: 1, digits: 1 }, sliding: { unit: "N", factor: 1, digits: 1 } },
    power: { signal: "jointPower", turning: { unit: "W", factor: 1, digits: 0 }, sliding: { unit: "W", factor: 1, digits: 0 } },
  };

  const written = (value, digits) => value.toFixed(digits).replace("-", "−");

  // [least, greatest] of numbers, of which NaN are absent
  function extent(values) {
    let low = Infinity, high = -Infinity;
    for (const value of values) {
      if (value < low) low = value;
      if (value > high) high = value;
    }
    return low > high ? [0, 0] : [low, high];
  }

  function shape(parent, name, attributes) {
    const element = document.createElementNS(SVG, name);
    Object.entries(attributes).forEach(([key, value]) => element.setAttribute(key, value));
    return parent.appendChild(element);
  }

  // The lowest and highest sample of every stretch, so that no peak is lost.
  function outline(values, x, y) {
    const width = Math.ceil(values.length / (POINTS / 2));
    let text = "", pen = "M";
    for (let from = 0; from < values.length; from += width) {
      let low = from, high = from;
      for (let i = from; i < Math.min(from + width, values.length); i++) {
        if (!(values[i] >= values[low])) low = i;
        if (!(values[i] <= values[high])) high = i;
      }
      for (const i of low === high ? [low] : [Math.min(low, high), Math.max(low, high)]) {
        if (Number.isNaN(values[i])) { pen = "M"; continue; }
        text += pen + x(i).toFixed(2) + " " + y(values[i]).toFixed(2);
        pen = "L";
      }
    }
    return text;
  }

  // Draws values over a run's time; returns what moves the cursor. `marks` are levels that are drawn where they fit in.
  function curve(svg, values, run, { zero = false, past = false, marks = [] } = {}) {
    let [low, high] = extent(values);
    if (zero) { low = Math.min(low, 0); high = Math.max(high, 0); }
    if (high <= low) { high += 1; low -= zero ? 0 : 1; }
    const x = (index) => (100 * index) / Math.max(values.length - 1, 1), y = (value) => 38 - (36 * (value - low)) / (high - low);
    svg.replaceChildren();
    svg.setAttribute("viewBox", "0 0 100 40");
    if (low < 0 && high > 0) shape(svg, "line", { class: "is-zero", x1: 0, x2: 100, y1: y(0), y2: y(0) });
    marks.filter((mark) => mark >= low && mark <= high).forEach((mark) =>
      shape(svg, "line", { class: "is-limit", x1: 0, x2: 100, y1: y(mark), y2: y(mark) }));
    const d = outline(values, x, y);
    shape(svg, "path", { class: past ? "is-all" : "is-past", d });
    const window = past ? shape(svg, "svg", { x: 0, y: 0, width: 0, height: 40 }) : null; // cuts off what is still to come
    if (window) shape(window, "path", { class: "is-past", d });
    const cursor = shape(svg, "line", { class: "is-now", y1: 0, y2: 40 });
    return (time) => {
      const place = (100 * (time - run.start)) / (run.end - run.start);
      if (window) window.setAttribute("width", Math.max(place, 0));
      cursor.setAttribute("x1", place);
      cursor.setAttribute("x2", place);
    };
  }

  function jointRows(body, joints) {
    return joints.map((joint) => {
      const row = body.insertRow(), name = document.createElement("th"), label = document.createElement("span");
      name.scope = "row";
      label.textContent = name.title = joint.name;
      name.append(label, document.createElement("small"));
      row.appendChild(name);
      const svg = document.createElementNS(SVG, "svg");
      svg.setAttribute("preserveAspectRatio", "none");
      svg.setAttribute("aria-hidden", "true");
      row.insertCell().appendChild(svg);
      return { row, svg, range: name.lastChild, value: row.insertCell() };
    });
  }

  function jointCurves(root, joints) {
    const rows = jointRows(root.querySelector(".is-joints").tBodies[0], joints), choice = root.querySelector(".is-quantity");
    let run = null, cursors = [], now = 0;

    function draw() {
      const quantity = QUANTITIES[choice.value], signals = run[quantity.signal];
      cursors = rows.map(({ svg, range }, j) => {
        const { unit, factor, digits } = joints[j].unit === "m" ? quantity.sliding : quantity.turning;
        const [low, high] = extent(signals[j]), marks = quantity.signal === "q" ? [joints[j].lower, joints[j].upper] : [];
        const few = unit.startsWith("m") ? 2 : 0;
        range.textContent = written(factor * low, few) + " to " + written(factor * high, few) + (unit === "°" ? unit : " " + unit);
        const move = curve(svg, signals[j], run, { marks });
        return (time) => {
          const value = run.at(signals[j], time), outside = quantity.signal === "q" && (value < joints[j].lower || value > joints[j].upper);
          rows[j].row.classList.toggle("is-outside", outside);
          rows[j].value.textContent = Number.isNaN(value) ? "–" : written(factor * value, digits) + (unit === "°" ? unit : " " + unit);
          move(time);
        };
      });
      at(now);
    }

    function at(time) {
      now = time;
      cursors.forEach((move) => move(time));
    }

    choice.addEventListener("change", draw);
    return {
      at,
      open(next) {
        run = next;
        now = run.start;
        for (const option of choice.options) option.disabled = !run[QUANTITIES[option.value].signal];
        if (choice.selectedOptions[0].disabled) choice.value = "position";
        draw();
      },
    };
  }

  function unitOf(joules) {
    if (joules >= 3.6e5) return { unit: "kWh", divide: 3.6e6, digits: 4 };
    return { unit: "Wh", divide: 3600, digits: 4 };
  }

  function panel(root, joints) {
    const find = (name) => root.querySelector("." + name), rows = jointCurves(root, joints), bar = find("is-bar").firstElementChild;
    let run = null, moves = [], most = 1, joules = String;

    function open(next) {
      run = next;
      most = Math.max(...extent(run.energy).map(Math.abs));
      const energy = unitOf(most);
      joules = (value) => (value / energy.divide).toFixed(energy.digits);
      find("is-energy-unit").textContent = energy.unit;
      find("is-energy-range").textContent = "0 to " + joules(run.energy[run.count - 1]) + " " + energy.unit;
      const [low, high] = extent(run.power);
      find("is-power-range").textContent = written(low, 0) + " to " + written(high, 0) + " W";
      find("is-low").textContent = written(low, 0) + " W";
      find("is-high").textContent = written(high, 0) + " W";
      moves = [
        curve(find("is-power-curve"), run.power, run, { zero: true, past: true }),
        curve(find("is-energy-curve"), run.energy, run, { zero: true, past: true }),
      ];
      rows.open(run);
    }

    function at(time) {
      find("is-time").value = time.toFixed(1);
      find("is-power").value = run.at(run.power, time).toFixed(0);
      find("is-energy").value = joules(run.at(run.energy, time));
      bar.style.transform = "scaleX(" + Math.min(Math.max(run.at(run.energy, time) / (most || 1), 0), 1) + ")";
      moves.forEach((move) => move(time));
      rows.at(time);
    }

    return { open, at };
  }

  return { panel, extent };
})();
