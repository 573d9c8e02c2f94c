"""The 3-D scene of a robot's modelled runs."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.packing import Fragment
from irtwin.report.explorer import Columns
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.virtual.performance import Performance
from irtwin.virtual.scene import scene_html


def draw_scene(robot: Robot, runs: Sequence[tuple[str, Columns]], opens: int) -> Fragment:
    """Return the fragment in which the robot performs runs, with torque and energy as its twin models them.

    Their times run from the start of each run, as in the page's charts.
    """
    return scene_html(robot, [_performance(robot, name, series) for name, series in runs], opens=opens)


def _performance(robot: Robot, name: str, series: Columns) -> Performance:
    q = np.column_stack([series[column] for column in CHANNELS["q"].columns(robot.joint_names)])
    torques = [series.get(f"{column}_model") for column in CHANNELS["torque"].columns(robot.joint_names)]
    absent = np.full(len(q), np.nan)
    torque = np.column_stack([absent if column is None else column for column in torques])
    return Performance(
        name=name,
        time=series["time"] - series["time"][0],
        q=q,
        energy=series["energy_model"],
        power=series["power_model"],
        torque=None if np.isnan(torque).all() else torque,
    )
