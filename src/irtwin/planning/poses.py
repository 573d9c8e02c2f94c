"""Where a motion starts and ends: joint positions, or a pose of the flange that joint positions are found for."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.identification.motion_limits import JointLimits
from irtwin.robot.collision import CollisionModel
from irtwin.robot.description import Robot
from irtwin.robot.inverse_kinematics import nearest

_STARTS = 60  # random joint positions from which a pose is sought
_ANGLE = 0.3  # m/rad: how a wrong direction weighs beside a wrong place
_SPACE = 1e-6  # rad: kept off the limits, so that rounding does not pass them
_FARTHEST = 1e3


@dataclass(frozen=True)
class Pose:
    """A pose of the flange in the base frame: place (3,) m; roll, pitch, yaw (3,) rad about the fixed x, y, z."""

    place: tuple[float, float, float]
    angles: tuple[float, float, float]

    @property
    def placement(self) -> pin.SE3:
        """The pose as Pinocchio's transform."""
        return pin.SE3(pin.rpy.rpyToMatrix(np.array(self.angles)), np.array(self.place))


def read_target(text: str, joints: int, option: str) -> np.ndarray | Pose:
    """Return the joint positions (n,) or the pose that an option says: "0,-1.57,..." or "pose:x,y,z,roll,pitch,yaw".

    Raises InputError on anything else.
    """
    of_flange = text.startswith("pose:")
    wanted = 6 if of_flange else joints
    try:
        values = [float(word) for word in text.removeprefix("pose:").split(",")]
    except ValueError:
        values = []
    if len(values) != wanted or not all(math.isfinite(value) and abs(value) <= _FARTHEST for value in values):
        shown = text if len(text) < 60 else f"{text[:60]}..."
        raise InputError(
            f'{option} "{shown}": give {joints} joint positions, as "0,-1.57,...", or a pose of the flange, as '
            '"pose:x,y,z,roll,pitch,yaw", in m and rad'
        )
    if of_flange:
        return Pose((values[0], values[1], values[2]), (values[3], values[4], values[5]))
    return np.array(values)


def joints_for(
    robot: Robot, target: np.ndarray | Pose, collisions: CollisionModel, near: np.ndarray | None, label: str
) -> np.ndarray:
    """Return joint positions (n,) of a target within all limits, clear of all; of several those nearest to `near`.

    Raises InputError where there are none: which joint is outside its limits, by how far the pose is out of reach, or
    which pair touches.
    """
    limits = JointLimits.of(robot)
    solutions = [target] if isinstance(target, np.ndarray) else _solutions(robot, target, limits, near, label)
    _check_limits(robot, solutions[0], label)
    for q in solutions:
        if not collisions.touches(q):
            return q
    pair = collisions.meeting(solutions[0])
    assert pair is not None
    raise InputError(f"{label} is in collision: {pair[0]} touches {pair[1]}; choose another one")


def follow(robot: Robot, target: pin.SE3, start: np.ndarray, limits: JointLimits) -> tuple[np.ndarray, float, float]:
    """Return joint positions within their limits near `start`, and how far they leave the target: m, rad."""
    return nearest(robot, target, start, limits.lower + _SPACE, limits.upper - _SPACE)


def _solutions(robot: Robot, pose: Pose, limits: JointLimits, near: np.ndarray | None, label: str) -> list[np.ndarray]:
    start = limits.centre if near is None else near
    random = np.random.default_rng(0).uniform(limits.lower, limits.upper, (_STARTS, len(start)))
    tries = [follow(robot, pose.placement, q, limits) for q in (start, *random)]
    solutions = [q for q, away, turned in tries if max(away, turned) < 1e-6]
    if not solutions:
        _, away, turned = min(tries, key=lambda attempt: attempt[1] + _ANGLE * attempt[2])
        shown = " ".join(f"{value:g}" for value in (*pose.place, *pose.angles))
        raise InputError(
            f"{label} {shown} is out of reach: the flange stays {1000 * away:.0f} mm and {np.degrees(turned):.1f} deg "
            "off it; choose a nearer pose"
        )
    return sorted(solutions, key=lambda q: float(np.linalg.norm(q - start)))


def _check_limits(robot: Robot, q: np.ndarray, label: str) -> None:
    for joint, value in zip(robot.joints, q, strict=True):
        if not joint.lower <= value <= joint.upper:
            raise InputError(
                f"{label}: {joint.name} at {value:g} {joint.unit} is outside its limits, {joint.lower:g} to "
                f"{joint.upper:g} {joint.unit}"
            )
