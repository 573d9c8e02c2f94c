"use strict";
// A robot as it moves: poses and power from events, which begin with its last minutes, numbers from /sparql each second.
// Needs MeshCat and robot.js.
// window.irtwinLive tells how well it keeps up: counts, and the newest lags and frames in ms.
(function () {
  const robotId = decodeURIComponent(location.pathname.split("/")[2]);
  const here = "/live/" + encodeURIComponent(robotId), iri = "id:robot\\/" + encodeURIComponent(robotId).replace(/[.!~*'()]/g, "\\$&");
  const KEPT = 4096; // lags and frames that are remembered
  const REMEMBERED = 300, BIN = 0.1; // s of the curve, of each bin of which the lowest sample and the highest are kept
  const SLOW_RATIO = 0.5; // of the screen's points are drawn where the processor draws
  const CURVE_EVERY = 45, MINUTES_EVERY = 200; // ms: of minutes a point of the screen is as long
  const find = (id) => document.getElementById(id);
  const seen = (window.irtwinLive = { events: 0, states: 0, drawn: 0, lags: [], drawnLags: [], frames: [], work: [], time: null });
  const clock = () => performance.timeOrigin + performance.now();
  const note = (list, value) => { list.push(value); if (list.length > KEPT) list.splice(0, KEPT / 2); };
  const written = (value, digits) => value.toFixed(digits).replace(/^-(?=[0.]*$)/, "").replace("-", "−"); // no −0.00

  // ---- samples

  const emptied = (curve) => Object.assign(curve, { time: [], power: [], bin: null, count: 0 });
  const measured = emptied({}), modelled = emptied({});
  let newest = null, fresh = false, isFlowing = true;

  seen.shown = () => [measured.time[0], measured.time[measured.time.length - 1], Math.min(...measured.power), Math.max(...measured.power)];

  function remove(curve, at, count) {
    curve.time.splice(at, count);
    curve.power.splice(at, count);
  }

  // Takes a sample. The newest bin holds the lowest, the highest and the newest of its samples, one before it the first two.
  function keep(curve, time, power) {
    if (curve.time.length && time <= curve.time[curve.time.length - 1]) return;
    if (curve.count === 3) {
      const last = curve.power.slice(-3), middle = [...last].sort((one, other) => one - other)[1];
      remove(curve, curve.power.length - 3 + last.indexOf(middle), 1);
      curve.count = 2;
    }
    const bin = Math.floor(time / BIN);
    if (bin !== curve.bin) Object.assign(curve, { bin, count: 0 });
    curve.count += 1;
    curve.time.push(time);
    curve.power.push(power);
    if (curve.time[0] < time - REMEMBERED - 10) remove(curve, 0, curve.time.findIndex((each) => each >= time - REMEMBERED));
  }

  const keepAll = (curve, said) => said.time.forEach((time, i) => keep(curve, time, said.power[i]));

  function take(event) {
    const said = JSON.parse(event.data);
    seen.events += 1;
    if (said.recent) {
      if (said.newest) takeState(said.newest);
      keepAll(measured, said.recent.measured);
      keepAll(modelled, said.recent.modelled);
    } else if (said.modelled) {
      keepAll(modelled, said.modelled);
    } else {
      note(seen.lags, clock() - 1000 * said.time);
      seen.states += 1;
      takeState(said);
      if (said.power !== null) keep(measured, said.time, said.power);
    }
  }

  function takeState(said) {
    if (newest && said.time < newest.time - 60) [measured, modelled].forEach(emptied); // its clock was set back
    seen.time = said.time;
    newest = said;
    fresh = true;
  }

  // ---- the curve

  const canvas = find("curve"), pen = canvas.getContext("2d"), style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue("--" + name);
  let scale = { low: 0, high: 100 }, shown = Number(find("span").value);
  find("span").addEventListener("change", (event) => { shown = Number(event.target.value); draw(); });

  function round(value) {
    const step = 10 ** Math.floor(Math.log10(Math.max(value, 1))) / 2;
    return Math.ceil(value / step) * step;
  }

  function draw() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2), width = canvas.clientWidth, height = canvas.clientHeight;
    if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
      canvas.width = Math.round(width * ratio);
      canvas.height = Math.round(height * ratio);
    }
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    let low = 0, high = 1;
    const end = newest ? newest.time : 0;
    for (const curve of [measured, modelled]) curve.power.forEach((value, i) => { if (curve.time[i] >= end - shown) { low = Math.min(low, value); high = Math.max(high, value); } });
    scale = { low: low < 0 ? -round(-low) : 0, high: round(high) };
    const left = 46, bottom = height - 18, top = 8;
    const x = (time) => left + ((time - end + shown) / shown) * (width - left - 8), y = (value) => bottom - ((value - scale.low) / (scale.high - scale.low)) * (bottom - top);
    pen.font = "11px system-ui, sans-serif";
    pen.fillStyle = colour("quiet");
    pen.strokeStyle = colour("line");
    pen.lineWidth = 1;
    pen.textAlign = "right";
    pen.textBaseline = "middle";
    for (const level of new Set([scale.low, 0, scale.high / 2, scale.high])) {
      pen.beginPath();
      pen.moveTo(left, Math.round(y(level)) + 0.5);
      pen.lineTo(width - 8, Math.round(y(level)) + 0.5);
      pen.stroke();
      if (level === 0 || Math.abs(y(level) - y(0)) > 11) pen.fillText(written(level, 0) + " W", left - 6, y(level));
    }
    pen.textAlign = "center";
    pen.textBaseline = "alphabetic";
    const [step, unit, name] = shown > 60 ? [60, 60, " min"] : [10, 1, " s"];
    for (let back = step; back <= shown; back += step) pen.fillText("−" + back / unit + name, Math.max(x(end - back), left), height - 4);
    pen.textAlign = "right";
    pen.fillText(isFlowing || !newest ? "now" : new Date(1000 * end).toLocaleTimeString(), width - 8, height - 4);
    pen.lineWidth = 1.5;
    [[measured, "ink"], [modelled, "warm"]].forEach(([curve, name]) => {
      pen.strokeStyle = colour(name);
      pen.beginPath();
      let before = null;
      curve.time.forEach((time, i) => {
        if (time < end - shown) return;
        if (before === null || time - before > 2) pen.moveTo(x(time), y(curve.power[i]));
        else pen.lineTo(x(time), y(curve.power[i]));
        before = time;
      });
      pen.stroke();
    });
  }

  // ---- the robot

  let robot = null, viewer = null, frameBefore = 0, curveAt = 0;

  async function build() {
    const said = find("drawing"), answer = await fetch(here + "/robot.json");
    if (!answer.ok) { said.textContent = await answer.text(); return; }
    const data = await answer.json();
    if (!irtwinRobot.supported()) { said.textContent = "This browser cannot draw the robot (no WebGL). The numbers go on."; return; }
    const slow = irtwinRobot.bySoftware();
    viewer = irtwinRobot.makeViewer(find("pane"), data.view, slow);
    if (slow) viewer.renderer.setPixelRatio(SLOW_RATIO);
    robot = irtwinRobot.build(viewer, data);
    viewer.set_3d_pane_size();
    said.textContent = newest ? "" : "As its last run left it; no sample comes yet.";
    if (!newest) robot.pose(data.stood);
    viewer.render();
  }

  function frame(stamp) {
    if (frameBefore) note(seen.frames, stamp - frameBefore);
    frameBefore = stamp;
    if (fresh) {
      const began = performance.now();
      fresh = false;
      if (robot) {
        find("drawing").textContent = "";
        robot.pose(newest.q);
        viewer.render();
      }
      if (stamp - curveAt > (shown > 60 ? MINUTES_EVERY : CURVE_EVERY)) {
        curveAt = stamp;
        draw();
      }
      if (measured.power.length) find("measured").value = written(measured.power[measured.power.length - 1], 0);
      if (modelled.power.length) find("modelled").value = written(modelled.power[modelled.power.length - 1], 0);
      seen.drawn += 1;
      note(seen.drawnLags, clock() - 1000 * newest.time);
      note(seen.work, performance.now() - began);
    }
    requestAnimationFrame(frame);
  }

  // ---- numbers, by SPARQL

  async function ask(query) {
    const answer = await fetch("/sparql?query=" + encodeURIComponent(query), { headers: { Accept: "application/sparql-results+json" } });
    if (!answer.ok) throw new Error((await answer.text()) || answer.statusText);
    return (await answer.json()).results.bindings.map((row) => Object.fromEntries(Object.entries(row).map(([name, { value }]) => [name, value])));
  }

  const RUN = `SELECT * WHERE {
    ${iri} irt:has_Information / irt:IR_Name ?name .
    OPTIONAL {
      { SELECT ?run { VALUES ?watched { irt:Live_Run irt:Replayed_Run } ?run irt:run_of ${iri} ; a ?watched ; irt:Start_Time ?began ; irt:Stream_State ?goes }
        ORDER BY (?goes = "ended") DESC(?began) LIMIT 1 }
      ?run irt:Start_Time ?start ; irt:Run_Time ?lasts ; irt:Sample_Count ?samples ; irt:Stream_State ?stream .
      OPTIONAL { ?run irt:Stale_Since ?since ; irt:Stale_Reason ?why }
      OPTIONAL { ?run irt:Energy_From ?from ; irt:Run_Power ?mean OPTIONAL { ?run irt:Measured_Energy ?measured } OPTIONAL { ?run irt:Modelled_Energy ?modelled } }
      BIND(COALESCE(?measured, ?modelled) AS ?energy)
      OPTIONAL { ?run irt:Energy_Error ?error }
      OPTIONAL { ?run irt:performs ?planned . ?planned irt:Run_Name ?plan OPTIONAL { ?planned irt:Planned_Energy ?expected } } } }`;
  const JOINTS = `SELECT ?label ?energy { ?taken a irt:Joint_Energy ; irt:of_Run ?RUN ; irt:of_Joint ?joint ; irt:Energy ?energy .
    ?joint irt:Joint_Name ?label ; irt:Joint_Number ?number } ORDER BY ?number`;
  const EFFECTS = `SELECT ?label (SUM(?each) AS ?energy) { ?share irt:share_of_Run ?RUN ; irt:of_Effect ?effect ; irt:Energy ?each .
    ?effect rdfs:label ?label } GROUP BY ?label ORDER BY DESC(?energy)`;
  const GAPS = `SELECT ?label ?residual ?band ?ratio ?unit ?state { ?gap a irt:Gap_State ; irt:gap_of_Run ?RUN ; irt:Gap_Residual ?residual ;
    irt:Gap_Band ?band ; irt:Gap_Ratio ?ratio ; qudt:hasUnit / qudt:symbol ?unit ; irt:Band_State ?state .
    OPTIONAL { ?gap irt:gap_at_Joint ?joint . ?joint irt:Joint_Name ?name ; irt:Joint_Number ?number }
    BIND(COALESCE(?name, "power") AS ?label) } ORDER BY COALESCE(?number, 99)`;
  const ALARMS = `SELECT ?state ?since ?until ?reason ?rule { ?alarm irt:alarm_of_Run ?RUN ; irt:Alarm_State ?state ;
    irt:Alarm_Since ?since ; irt:Alarm_Reason ?reason ; irt:raised_by_Rule ?rule OPTIONAL { ?alarm irt:Alarm_Until ?until } } ORDER BY ?state DESC(?since)`;

  const element = (kind, text, name) => Object.assign(document.createElement(kind), { textContent: text, className: name || "" });

  function bars(place, rows, text, share, more) {
    const made = rows.flatMap((row) => {
      const bar = element("div", "", "bar" + (row.state === "outside" ? " outside" : "")), fill = document.createElement("b");
      fill.style.width = 100 * Math.min(Math.max(share(row), 0), 1) + "%";
      bar.append(fill);
      if (more) more(bar);
      const label = element("span", row.label);
      label.title = row.label;
      return [label, bar, element("span", text(row))];
    });
    find(place).replaceChildren(...(made.length ? made : [element("span", "not known yet", "quiet")]));
  }

  const inHours = (joules) => (Math.abs(joules) >= 3.6e5 ? [written(joules / 3.6e6, 3), "kWh"] : [written(joules / 3600, 2), "Wh"]);

  function showRun(run) {
    document.title = run.name + ", live";
    find("name").textContent = run.name;
    const stream = run.stream || "not watched yet";
    find("stream").textContent = stream === "ended" ? "run ended" : stream;
    find("stream").className = "stream " + (run.stream || "");
    isFlowing = stream === "flowing";
    find("run-page").hidden = stream !== "ended";
    find("curve").hidden = !newest && stream === "ended";
    if (run.run) find("run-page").href = "/run/" + run.run.split("/").pop();
    document.querySelector("main").classList.toggle("is-stale", stream === "stale");
    find("why").textContent = run.why && stream === "stale" ? run.why + "; the last good state is of " + new Date(run.since).toLocaleTimeString() : "";
    const [energy, unit] = run.energy === undefined ? ["–", "Wh"] : inHours(Number(run.energy));
    find("energy").value = energy;
    find("energy-unit").textContent = unit;
    const plan = run.plan && "plan " + run.plan + (run.expected === undefined ? "" : ": " + inHours(Number(run.expected)).join(" "));
    const said = [run.from, plan].filter(Boolean).join("; ");
    find("from").textContent = said && "(" + said + ")";
    find("mean").value = run.mean === undefined ? "–" : written(Number(run.mean), 0);
    find("error").value = run.error === undefined ? "–" : written(Number(run.error), 1);
    find("lasts").value = run.lasts === undefined ? "–" : written(Number(run.lasts), 0);
    find("samples").value = run.samples === undefined ? "–" : Number(run.samples).toLocaleString("en");
  }

  function showAlarms(alarms) {
    const at = (moment) => new Date(moment).toLocaleTimeString();
    const made = alarms.map((alarm) => {
      const item = element("li", alarm.reason, alarm.state);
      const rule = alarm.rule.split("/").pop();
      item.append(element("small", "since " + at(alarm.since) + (alarm.until ? ", cleared at " + at(alarm.until) : "") + "; rule:" + rule));
      item.title = alarm.rule;
      return item;
    });
    find("alarms").replaceChildren(...(made.length ? made : [element("li", "none", "quiet")]));
  }

  async function poll() {
    const trouble = find("trouble");
    try {
      const [run] = await ask(RUN);
      if (!run) throw new Error("no robot " + robotId + " is in the graph");
      showRun(run);
      if (run.run) {
        const of = (query) => ask(query.replace(/\?RUN/g, "<" + run.run + ">"));
        const [joints, effects, gaps, alarms] = await Promise.all([JOINTS, EFFECTS, GAPS, ALARMS].map(of));
        const energies = (rows) => { const most = Math.max(...rows.map((row) => Math.abs(row.energy)), 1e-9); return (row) => Math.abs(row.energy) / most; };
        const joules = (row) => inHours(Number(row.energy)).join(" ");
        bars("by-joint", joints, joules, energies(joints));
        bars("by-effect", effects, joules, energies(effects));
        bars("gaps", gaps, (row) => written(Number(row.residual), 1) + " of " + written(Number(row.band), 1) + " " + row.unit, (row) => row.ratio / 2,
          (bar) => { const edge = document.createElement("u"); edge.style.left = "50%"; bar.append(edge); });
        showAlarms(alarms);
      }
      trouble.hidden = true;
    } catch (error) {
      trouble.textContent = error.message;
      trouble.hidden = false;
    }
    setTimeout(poll, 1000);
  }

  find("robot-page").href = "/robot/" + encodeURIComponent(robotId);
  for (const place of ["by-joint", "by-effect", "gaps"]) bars(place, []);
  function follow() {
    const events = new EventSource(here + "/events");
    events.onmessage = take;
    events.onerror = () => { // a browser comes again by itself, but not once it was refused
      if (events.readyState === EventSource.CLOSED) setTimeout(follow, 5000);
    };
  }

  follow();
  build().catch((error) => { find("drawing").textContent = error.message; });
  poll();
  requestAnimationFrame(frame);
})();
