"""Small robots for the tests of this room."""

from __future__ import annotations

from math import radians

from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf

# KR6 R700: origin, axis, position limits (deg), speed limit (deg/s), mass (kg)
_KR6 = [
    ("joint_a1", "0 0 0.400", "0 0 -1", -170, 170, 360, 10.0),
    ("joint_a2", "0.025 0 0", "0 1 0", -190, 45, 300, 9.0),
    ("joint_a3", "0.315 0 0", "0 1 0", -120, 156, 360, 7.0),
    ("joint_a4", "0 0 0.035", "-1 0 0", -185, 185, 381, 4.0),
    ("joint_a5", "0.365 0 0", "0 1 0", -120, 120, 388, 2.0),
    ("joint_a6", "0.080 0 0", "-1 0 0", -350, 350, 615, 0.5),
]


def link(name: str, mass: float) -> str:
    return (
        f'<link name="{name}"><inertial><origin xyz="0.05 0.01 0.02"/><mass value="{mass}"/>'
        '<inertia ixx="0.02" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>'
    )


def joint(name: str, parent: str, child: str, origin: str, axis: str, limit: str, kind: str = "revolute") -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{origin}"/><axis xyz="{axis}"/>{limit}</joint>'
    )


def kr6() -> Robot:
    parts = ['<link name="base"/>']
    parent = "base"
    for name, origin, axis, lower, upper, speed, mass in _KR6:
        child = f"link_{name}"
        limit = f'<limit lower="{radians(lower)}" upper="{radians(upper)}" velocity="{radians(speed)}" effort="500"/>'
        parts += [link(child, mass), joint(name, parent, child, origin, axis, limit)]
        parent = child
    return parse_urdf(f'<robot name="kr6">{"".join(parts)}</robot>')


def two_joints(first: str = '<limit lower="-2" upper="2" velocity="3" effort="9"/>', kind: str = "revolute") -> Robot:
    """A vertical turning joint that carries a horizontal one, half a metre up; `first` is the first joint's limit."""
    second = '<limit lower="-1.5" upper="1.5" velocity="2" effort="9"/>'
    return parse_urdf(
        '<robot name="two"><link name="base"/>'
        + link("upper", 3.0)
        + link("fore", 2.0)
        + '<link name="tip"/>'
        + joint("turn", "base", "upper", "0 0 0.5", "0 0 1", first, kind)
        + joint("lift", "upper", "fore", "0.2 0 0", "0 1 0", second)
        + joint("tip", "fore", "tip", "0.3 0 0", "0 0 1", "", "fixed")
        + "</robot>"
    )
