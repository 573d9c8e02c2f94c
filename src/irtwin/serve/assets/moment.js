"use strict";
// The robot in three dimensions as it stood at the moment that the curves show. Needs robot.js, follows curves.js.
(function () {
  const figure = document.getElementById("stands"), said = figure.querySelector("figcaption");
  const lines = JSON.parse(document.getElementById("curves").dataset.curves).panels.flatMap((panel) => panel.lines);
  let viewer = null, robot = null, names = [], now = null; // now: what curves.js told, time in s and curves by their key

  function at([time, values], moment) {
    const after = time.findIndex((each) => each >= moment);
    if (after < 1) return values[after < 0 ? values.length - 1 : 0];
    const share = (moment - time[after - 1]) / (time[after] - time[after - 1]);
    return values[after - 1] + share * (values[after] - values[after - 1]);
  }

  function position(name) {
    const line = lines.find((each) => each.channel === "q_" + name);
    const curve = line && now.curves.get([line.run, line.kind, line.channel].join("|"));
    return curve ? at(curve, now.time) : 0;
  }

  function show() {
    if (!robot || !now) return;
    robot.pose(names.map(position));
    viewer.render();
    said.textContent = `at ${now.time.toFixed(2)} s`;
  }

  async function build() {
    const answer = await fetch(figure.dataset.robot);
    if (!answer.ok) { said.textContent = await answer.text(); return; }
    if (!irtwinRobot.supported()) { said.textContent = "This browser cannot draw the robot (no WebGL)."; return; }
    const data = await answer.json();
    viewer = irtwinRobot.makeViewer(figure.querySelector("div"), data.view, irtwinRobot.bySoftware());
    robot = irtwinRobot.build(viewer, data);
    names = data.joints.map((joint) => joint.name);
    viewer.set_3d_pane_size();
    show();
  }

  document.addEventListener("irtwin:time", ({ detail }) => { now = { ...detail, time: detail.time ?? 0 }; show(); });
  window.addEventListener("load", build);
})();
