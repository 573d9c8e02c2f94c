"""Where the flange of a robot is."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange


def flange_position(robot: Robot, q: np.ndarray) -> np.ndarray:
    """Return the flange's position in the base frame, (N, 3) m, along the joint positions `q`: (N, n) rad."""
    model, data = robot.model, robot.model.createData()
    frame = model.getFrameId(flange(robot), pin.FrameType.BODY)
    positions = np.empty((len(q), 3))
    for row, sample in enumerate(np.asarray(q, dtype=float)):
        pin.forwardKinematics(model, data, sample)
        positions[row] = pin.updateFramePlacement(model, data, frame).translation
    return positions
