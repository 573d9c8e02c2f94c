"use strict";
// Draws the robot in the first and the last pose of the run that the scene opens on, by the scene's own data.
(function () {
  const scene = document.querySelector(".irtwin-scene");
  if (!scene || !window.irtwinRobot || !irtwinRobot.supported()) {
    document.querySelectorAll(".pose").forEach((pose) => { pose.hidden = true; });
    return;
  }
  const data = JSON.parse(scene.querySelector('script[type="application/json"]').textContent), run = data.runs[data.opens];

  function positions(last) {
    return run.q.map(function ({ data, offset, scale }) {
      const bytes = Uint8Array.from(atob(data), (letter) => letter.charCodeAt(0)), levels = new Int16Array(bytes.buffer);
      return offset + scale * levels[last ? levels.length - 1 : 0];
    });
  }

  for (const pose of document.querySelectorAll(".pose")) {
    const pane = pose.querySelector("div"), viewer = irtwinRobot.makeViewer(pane, data.view);
    irtwinRobot.build(viewer, data).pose(positions(pose.dataset.at === "last"));
    viewer.set_3d_pane_size();
    const picture = pose.querySelector("img");
    picture.src = viewer.capture_image(); // for paper
  }
})();
