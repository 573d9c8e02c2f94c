"""A robot's model as it were if the robot stood otherwise, or a joint turned about another axis."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pinocchio as pin

from irtwin.robot.kinematics import joint_motions


def tilted(model: pin.Model, by: tuple[float, float, float]) -> pin.Model:
    """Return the model with its base turned by a small vector (3,), rad."""
    copied = model.copy()
    copied.gravity.linear = model.gravity.linear + np.cross(by, model.gravity.linear)
    return copied


def turned_axes(model: pin.Model) -> Iterator[tuple[int, pin.Model]]:
    """Yield each joint, from 0, with the model in which its axis is turned by a quarter, about either normal of it.

    At zero all links stay where they are.
    """
    for joint, motion in enumerate(joint_motions(model), start=1):
        axis = motion[:3] + motion[3:]  # a joint slides or turns
        normal = np.cross(axis, np.eye(3)[np.argmin(np.abs(axis))])
        for about in (normal, np.cross(axis, normal)):
            turn = pin.SE3(pin.AngleAxis(np.pi / 2, about / np.linalg.norm(about)).matrix(), np.zeros(3))
            copied = model.copy()
            copied.jointPlacements[joint] = model.jointPlacements[joint] * turn
            for child in model.children[joint]:
                copied.jointPlacements[child] = turn.inverse() * model.jointPlacements[child]
            yield joint - 1, copied
