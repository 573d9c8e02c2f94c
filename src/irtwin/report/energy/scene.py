"""The 3-D scene of the run that a page opens on."""

from __future__ import annotations

import numpy as np

from irtwin.report.explorer import Columns
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.virtual.scene import scene_html


def draw_scene(robot: Robot, series: Columns) -> str:
    """Return the fragment in which the robot performs a modelled series, with the energy that its twin says it used.

    Its time runs from the start of the run, as in the page's charts.
    """
    time = series["time"] - series["time"][0]
    q = np.column_stack([series[name] for name in CHANNELS["q"].columns(robot.joint_names)])
    return scene_html(robot, time, q, series["energy_model"], series["power_model"])
