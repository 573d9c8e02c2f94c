"""Arms with collision shapes, for the tests of this room."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tests.synthetic import measure, swing

from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf
from irtwin.twin.identify import identify
from irtwin.twin.twin import Twin

_AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
_LENGTHS = (0.3, 0.4, 0.2, 0.2, 0.1, 0.1)


def arm(joints: int = 3, effort: float = 300.0, shapes: bool = True) -> Robot:
    """An arm that stands upright at zero, each link a cylinder as long as to the next joint but for a gap."""
    parts = ['<link name="base"/>']
    height = 0.0
    for k in range(joints):
        mass, length = 8.0 / (k + 1), _LENGTHS[k]
        solid = f'<collision><origin xyz="0 0 {length / 2}"/><geometry><cylinder radius="0.04" length="{length}"/>'
        parts.append(
            f'<link name="link_{k + 1}"><inertial><origin xyz="0.01 0.02 {length / 2}"/><mass value="{mass}"/>'
            f'<inertia ixx="{0.02 * mass}" iyy="{0.02 * mass}" izz="{0.01 * mass}" ixy="0" ixz="0" iyz="0"/></inertial>'
            + (f"{solid}</geometry></collision>" if shapes else "")
            + f'</link><joint name="joint_{k + 1}" type="revolute"><parent link="{f"link_{k}" if k else "base"}"/>'
            f'<child link="link_{k + 1}"/><origin xyz="0 0 {height}"/><axis xyz="{_AXES[k]}"/>'
            f'<limit lower="-2.8" upper="2.8" velocity="3" effort="{effort}"/></joint>'
        )
        height = length
    parts.append(
        f'<link name="flange"/><joint name="flange" type="fixed"><parent link="link_{joints}"/><child link="flange"/>'
        f'<origin xyz="0 0 {height}"/></joint>'
    )
    return parse_urdf(f'<robot name="boxed_{joints}">{"".join(parts)}</robot>')


def twin_of(robot: Robot, *, power: bool = True) -> Twin:
    """A twin fitted to what a robot of known truth shows."""
    motions = [measure(robot, swing(robot, seed, seconds=10.0)) for seed in (1, 2)]
    if not power:
        motions = [replace(motion, power=None) for motion in motions]
    return identify(robot, motions)


def folded(robot: Robot) -> np.ndarray:
    """A pose in which the last of three links lies in the first."""
    pose = np.zeros(len(robot.joints))
    pose[1], pose[2] = 2.6, 2.6
    return pose
