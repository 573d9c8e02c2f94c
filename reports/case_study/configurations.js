"use strict";
// Draws the robot in the first and the last pose of the run that the scene opens on, by the scene's own data.
(function () {
  const scene = document.querySelector(".irtwin-scene");
  if (!scene || !window.irtwinRobot || !irtwinRobot.supported()) {
    document.querySelectorAll(".pose").forEach((pose) => { pose.hidden = true; });
    return;
  }
  const data = JSON.parse(scene.querySelector('script[type="application/json"]').textContent);
  const q = data.runs[data.opens].q.map(irtwinRobot.unpack);

  const positions = (place) => q.map((values) => values.at(place));

  for (const pose of document.querySelectorAll(".pose")) {
    const pane = pose.querySelector("div"), viewer = irtwinRobot.makeViewer(pane, data.view);
    irtwinRobot.build(viewer, data).pose(positions(pose.dataset.at === "last" ? -1 : 0));
    viewer.set_3d_pane_size();
    pose.querySelector("img").src = viewer.capture_image(); // for paper
  }
})();
