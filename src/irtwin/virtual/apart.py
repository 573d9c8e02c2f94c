"""A robot and its simulator at one moment, in three dimensions: two robots in a picture that differ in pose alone."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from markupsafe import Markup

from irtwin.packing import Fragment, embedded_json, packed_scripts
from irtwin.robot.description import Robot
from irtwin.robot.meshes import Mesh
from irtwin.virtual.robot_data import asset, robot_data, viewer_script
from irtwin.virtual.scene import template


def apart_html(
    robot: Robot, q: np.ndarray, simulators: Mapping[str, np.ndarray], meshes: Mapping[str, Mesh] | None = None
) -> Fragment:
    """Return an HTML fragment, with its style and scripts: a picture for each of the simulator's poses, by caption.

    q, and each pose: (n,) rad or m. It loads nothing. `meshes` are those that the robot's description names; other
    shapes stand in for the rest.
    """
    poses = np.array([q, *simulators.values()])
    data = robot_data(robot, poses, meshes) | {
        "robot": q.tolist(),
        "simulators": [pose.tolist() for pose in simulators.values()],
    }
    scripts = packed_scripts([viewer_script(), asset("robot.js"), asset("apart.js")])
    html = template("apart.html.jinja").render(
        robot=robot.name,
        captions=list(simulators),
        data=embedded_json(data),
        style=asset("apart.css"),
        scripts=scripts.html,
    )
    return Fragment(Markup(html), scripts.scripts)
