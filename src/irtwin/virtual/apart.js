"use strict";
// Draws a robot twice in each picture: as it was, and as a simulator had it at that moment, translucent.
// Needs robot.js, fetches nothing.
(function () {
  const COLOUR = [0.84, 0.37, 0, 0.55];

  function draw(picture, data, simulator) {
    const viewer = irtwinRobot.makeViewer(picture.querySelector(".ia-pane"), data.view);
    const parts = data.parts.filter(({ joint }) => joint >= 0).map((part) => ({ ...part, colour: COLOUR })); // one base does
    irtwinRobot.build(viewer, data).pose(data.robot);
    irtwinRobot.build(viewer, { ...data, parts }, "simulator").pose(simulator);
    viewer.set_3d_pane_size();
    picture.querySelector("img").src = viewer.capture_image(); // for paper
  }

  for (const root of document.querySelectorAll(".irtwin-apart")) {
    const data = JSON.parse(root.querySelector('script[type="application/json"]').textContent);
    root.hidden = !irtwinRobot.supported();
    if (!root.hidden) root.querySelectorAll(".ia-picture").forEach((picture, place) => draw(picture, data, data.simulators[place]));
  }
})();
