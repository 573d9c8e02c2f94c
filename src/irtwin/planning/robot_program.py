"""A motion as a robot's program: URScript of Universal Robots, or KRL of KUKA."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from irtwin.errors import InputError
from irtwin.identification.motion_limits import JointLimits
from irtwin.planning.path import way_along
from irtwin.robot.description import Robot
from irtwin.signals.motion import BRIEF, Motion, standstill, stretches

_OFF = 0.01  # rad: what a straight way between two poses may leave the motion by
_BLEND = 0.005  # m: how near a UR passes a pose on the way
_ACCELERATION = 1.4  # rad/s^2: URScript's own, which a time overrules
_AXES = 6
_LONGEST_NAME = 24  # of a KRL module
_SLOWLY = 0.1  # of the axes' speed, to where the motion starts
_CHECK = "Joint positions are those of the URDF: compare zeros and signs with the controller's first."


@dataclass(frozen=True)
class Step:
    """Go to a pose (n,) rad in `seconds`, `through` it or to rest there; without a pose: wait."""

    seconds: float
    pose: np.ndarray | None = None
    through: bool = False
    speed: np.ndarray | None = None  # (n,) rad/s, the greatest on the way
    acceleration: np.ndarray | None = None  # (n,) rad/s^2


def steps(motion: Motion) -> Iterator[Step]:
    """Yield what leads along a motion: straight ways in joint space, pauses between its moves."""
    time, pausing = motion.time, np.zeros(len(motion.time), dtype=bool)
    for own in stretches(standstill(motion)):
        pausing[own] = time[own.stop - 1] - time[own.start] >= BRIEF
    at = 0
    for own in stretches(~pausing):
        if time[own.start] - time[at] >= BRIEF:
            yield Step(float(time[own.start] - time[at]))
        first, at = max(own.start - 1, 0), min(own.stop, len(time) - 1)
        corners = [first, *_between(motion.q, first, at), at]
        for start, end in pairwise(corners):
            part = slice(start, end + 1)
            most = (np.abs(values[part]).max(axis=0) for values in (motion.dq, motion.ddq))
            yield Step(float(time[end] - time[start]), motion.q[end], end != at, *most)
    if time[-1] - time[at] >= BRIEF:
        yield Step(float(time[-1] - time[at]))


def urscript(motion: Motion, robot: Robot, name: str) -> str:
    """Return a motion as URScript: `movej` in rad, each with the time that it takes.

    Raises InputError where the robot has not six turning joints.
    """
    _check(robot, "URScript")
    start = f"  movej({_ur(motion.q[0])}, a={_ACCELERATION}, v=0.5)"
    lines = [f"def {_identifier(name)}():", f"  # {_CHECK}", start]
    for step in steps(motion):
        if step.pose is None:
            lines.append(f"  sleep({step.seconds:.3f})")
            continue
        assert step.speed is not None
        blend = _BLEND if step.through else 0
        speed = max(float(step.speed.max()), 0.001)
        lines.append(f"  movej({_ur(step.pose)}, a={_ACCELERATION}, v={speed:.4f}, t={step.seconds:.3f}, r={blend})")
    return "\n".join([*lines, "end", ""])


def krl(motion: Motion, robot: Robot, name: str) -> str:
    """Return a motion as KRL: `PTP` in degrees, each with the speed and acceleration of axes that it takes, %.

    Raises InputError where the robot has not six turning joints, or a limit of their speed is not known.
    """
    _check(robot, "KRL")
    speeds = JointLimits.of(robot).speed
    accelerations = np.array([joint.acceleration or np.inf for joint in robot.joints])
    start = [*_axes(np.full(_AXES, _SLOWLY), np.ones(_AXES)), f"PTP {_kuka(motion.q[0])}"]
    lines = [f"DEF {_identifier(name)}()", f";{_CHECK}", "BAS(#INITMOV,0)", "$APO.CPTP=50", *start]
    for step in steps(motion):
        if step.pose is None:
            lines.append(f"WAIT SEC {step.seconds:.3f}")
            continue
        assert step.speed is not None and step.acceleration is not None
        lines += _axes(step.speed / speeds, step.acceleration / accelerations)
        lines.append(f"PTP {_kuka(step.pose)}{' C_PTP' if step.through else ''}")
    return "\n".join([*lines, "END", ""])


WRITERS = {".script": urscript, ".src": krl}


def _between(q: np.ndarray, first: int, last: int) -> list[int]:
    """Return the samples between two at which a way of straight lines has to turn (Douglas and Peucker, 1973)."""
    way = way_along(q[first : last + 1])
    share = way / max(way[-1], 1e-12)
    off = np.abs(q[first : last + 1] - (q[first] + share[:, None] * (q[last] - q[first]))).max(axis=1)
    worst = first + int(np.argmax(off))
    if off.max() <= _OFF or worst in (first, last):
        return []
    return [*_between(q, first, worst), worst, *_between(q, worst, last)]


def _check(robot: Robot, language: str) -> None:
    if len(robot.joints) != _AXES or any(joint.kind == "prismatic" for joint in robot.joints):
        raise InputError(f"{robot.name}: {language} is written for six turning joints; write the motion as .csv")


def _axes(speed: np.ndarray, acceleration: np.ndarray) -> Iterator[str]:
    """Yield the lines that set speed and acceleration of the axes, shares of their own as whole percent."""
    for name, shares in (("VEL", speed), ("ACC", np.where(acceleration > 0, acceleration, 1.0))):
        for axis, percent in enumerate(np.clip(np.ceil(100 * shares), 1, 100).astype(int), start=1):
            yield f"${name}_AXIS[{axis}]={percent}"


def _ur(q: np.ndarray) -> str:
    return "[" + ", ".join(f"{value:.6f}" for value in q) + "]"


def _kuka(q: np.ndarray) -> str:
    return "{" + ", ".join(f"A{axis} {value:.4f}" for axis, value in enumerate(np.degrees(q), start=1)) + "}"


def _identifier(name: str) -> str:
    """Return a name that both languages take: letters, digits, underscores, a letter first."""
    word = re.sub(r"\W", "_", name, flags=re.ASCII)
    return (word if word[:1].isalpha() else f"p_{word}")[:_LONGEST_NAME]
