"""Forward kinematics: where the links of a robot are."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from irtwin.errors import InputError
from irtwin.robot.description import Link, Robot


def link_placements(robot: Robot, q: np.ndarray) -> dict[str, np.ndarray]:
    """Return the (4, 4) placement of each link in the base frame (m) at the joint positions `q`: (n,) rad."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.asarray(q, dtype=float))
    return {link.name: np.asarray(data.oMf[frame].homogeneous) for link, frame in _frames(robot)}


def flange(robot: Robot) -> str:
    """Return the name of the last link: the one farthest down the tree, the first of several."""
    depths = [0]
    for frame in list(robot.model.frames)[1:]:  # a parent comes before its children
        depths.append(depths[frame.parentFrame] + 1)
    return max(_frames(robot), key=lambda entry: depths[entry[1]])[0].name


def link_frame(robot: Robot, link: str) -> int:
    """Return Pinocchio's number of a link's frame. Raises InputError where the robot has no such link."""
    if link not in (known.name for known in robot.links):
        raise InputError(f'{robot.name} has no link "{link}" (it has {", ".join(known.name for known in robot.links)})')
    return int(robot.model.getFrameId(link, pin.FrameType.BODY))


def placements(robot: Robot, q: np.ndarray, link: str | None = None) -> np.ndarray:
    """Return the placements of a link, the flange where None, in the base frame: (N, 4, 4) m, at `q`: (N, n) rad or m.

    Raises InputError where the robot has no such link.
    """
    model, data = robot.model, robot.model.createData()
    frame = link_frame(robot, link or flange(robot))
    result = np.empty((len(q), 4, 4))
    for row, sample in enumerate(np.asarray(q, dtype=float)):
        pin.forwardKinematics(model, data, sample)
        result[row] = pin.updateFramePlacement(model, data, frame).homogeneous
    return result


def joint_motions(model: pin.Model) -> np.ndarray:
    """Return what a unit of each joint's speed makes of its body's motion, (n, 6): line, then turn, in its frame."""
    data = model.createData()
    pin.computeJointJacobians(model, data, pin.neutral(model))
    jacobians = (pin.getJointJacobian(model, data, joint, pin.LOCAL) for joint in range(1, model.njoints))
    return np.array([np.reshape(jacobian, (6, -1))[:, joint] for joint, jacobian in enumerate(jacobians)])


def joint_axes(robot: Robot, poses: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the directions (P, n, 3) of the joints' axes in the base frame in poses (P, n), and a point on each, m."""
    motions, data = joint_motions(robot.model), robot.model.createData()
    own = motions[:, :3] + motions[:, 3:]  # a joint slides or turns
    directions, points = [], []
    for pose in poses:
        pin.forwardKinematics(robot.model, data, pose)
        placed = list(data.oMi)[1:]
        directions.append([placement.rotation @ axis for placement, axis in zip(placed, own, strict=True)])
        points.append([placement.translation.copy() for placement in placed])
    return np.array(directions), np.array(points)


def ranges(robot: Robot) -> tuple[np.ndarray, np.ndarray]:
    """Return the least and the greatest positions to draw, (n,) rad or m: within the limits, at most pi either way."""
    lower, upper = robot.limits
    middle = np.clip(0.0, lower, upper)
    return np.maximum(lower, middle - np.pi), np.minimum(upper, middle + np.pi)


def levers(robot: Robot, joint: int, distance: float, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return how far, (n,) m, a point can be from each joint that moves it, within limits (n,); 0 of the others.

    It is fixed to a joint, by Pinocchio's number, at a distance, m. A joint that slides moves all behind it by its own
    speed: its lever is 1.
    """
    lever = np.zeros(len(robot.joints))
    while joint > 0:
        column = joint - 1  # the universe is Pinocchio's joint 0
        slides = robot.joints[column].kind == "prismatic"
        lever[column] = 1.0 if slides else distance
        if slides:
            distance += max(abs(lower[column]), abs(upper[column]))
        distance += float(np.linalg.norm(robot.model.jointPlacements[joint].translation))
        joint = robot.model.parents[joint]
    return lever


def _frames(robot: Robot) -> list[tuple[Link, int]]:
    return [(link, robot.model.getFrameId(link.name, pin.FrameType.BODY)) for link in robot.links]
