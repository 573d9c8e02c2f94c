"""Inverse kinematics: the joint positions that bring the flange to a pose."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_frame

_STEPS = 60
_REACHED = 1e-9  # m and rad
_DAMPING, _LEAST_DAMPING = 1e-3, 1e-12

Left = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]  # of q (n,): (6,) m and rad to the goal, (6, n) its slope


def nearest(
    robot: Robot, target: pin.SE3, start: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Return where a descent of the flange to a target from `start` (n,) ends, and what is left: m, rad."""
    model, data, frame = robot.model, robot.model.createData(), link_frame(robot, flange(robot))

    def away(q: np.ndarray) -> pin.SE3:
        pin.computeJointJacobians(model, data, q)
        return target.actInv(pin.updateFramePlacement(model, data, frame))

    def left(q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        off = away(q)
        jacobian = np.reshape(pin.getFrameJacobian(model, data, frame, pin.LOCAL), (6, -1))
        return np.asarray(pin.log6(off).vector), np.asarray(pin.Jlog6(off) @ jacobian)

    q = _descended(left, np.clip(start, lower, upper), lower, upper)
    off = away(q)
    return q, float(np.linalg.norm(off.translation)), float(np.linalg.norm(pin.log3(off.rotation)))


def _descended(left: Left, q: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Return where a descent from `q` (n,) ends, by damped least squares within limits."""
    damping = _DAMPING
    value, slope = left(q)
    for _ in range(_STEPS):
        if np.linalg.norm(value) < _REACHED * 1e-2:
            break
        free = ~(((q <= lower) & (slope.T @ value > 0)) | ((q >= upper) & (slope.T @ value < 0)))
        step = np.zeros_like(q)
        step[free] = -_damped_step(slope[:, free], value, damping)
        tried = np.clip(q + step, lower, upper)
        new, new_slope = left(tried)
        if new @ new < value @ value:
            q, value, slope = tried, new, new_slope
            damping = max(damping * 0.2, _LEAST_DAMPING)
        else:
            damping *= 10
            if damping > 1e6:
                break
    return q


def _damped_step(slope: np.ndarray, value: np.ndarray, damping: float) -> np.ndarray:
    """Return x, (n,), of least |slope x - value|^2 + damping |x|^2; slope: (m, n), value: (m,).

    Nakamura and Hanafusa (1986). The slope is not squared: links may be kilometres long.
    """
    count = slope.shape[1]
    stacked = np.vstack([slope, np.sqrt(damping) * np.eye(count)])
    return np.asarray(np.linalg.lstsq(stacked, np.append(value, np.zeros(count)))[0])
