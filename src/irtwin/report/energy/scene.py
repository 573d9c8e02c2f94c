"""The 3-D scene of a robot's modelled runs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from irtwin.packing import Fragment
from irtwin.report.explorer import Columns
from irtwin.robot.description import Robot
from irtwin.robot.meshes import Mesh
from irtwin.signals.channels import CHANNELS
from irtwin.virtual.performance import Performance
from irtwin.virtual.scene import scene_html


def draw_scene(robot: Robot, meshes: Mapping[str, Mesh], runs: Sequence[tuple[str, Columns]], opens: int) -> Fragment:
    """Return the fragment in which the robot performs runs, with torque and energy as its twin models them.

    meshes: by the names that the robot's description gives them. Times run from the start of each run, as in the page's
    charts.
    """
    performances = [_performance(robot, name, series) for name, series in runs]
    return scene_html(robot, performances, opens=opens, meshes=meshes)


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
