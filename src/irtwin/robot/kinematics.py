"""Forward kinematics: where the links of a robot are."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

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


def _frames(robot: Robot) -> list[tuple[Link, int]]:
    return [(link, robot.model.getFrameId(link.name, pin.FrameType.BODY)) for link in robot.links]
