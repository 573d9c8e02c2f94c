"""Inverse kinematics: the joint positions that bring the flange to a pose."""

from __future__ import annotations

import numpy as np
import pinocchio as pin

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_frame

_STEPS = 60
_REACHED = 1e-9  # m and rad
_DAMPING, _LEAST_DAMPING = 1e-3, 1e-12


def nearest(
    robot: Robot, target: pin.SE3, start: np.ndarray, lower: np.ndarray, upper: np.ndarray
) -> tuple[np.ndarray, float, float]:
    """Return where a descent of the flange to a target from `start` (n,) ends, and what is left: m, rad."""
    search = _Search(robot, link_frame(robot, flange(robot)), target, lower, upper)
    q = search.descend(np.clip(start, lower, upper))
    left = target.actInv(search.place(q))
    return q, float(np.linalg.norm(left.translation)), float(np.linalg.norm(pin.log3(left.rotation)))


def _damped_step(slope: np.ndarray, value: np.ndarray, damping: float) -> np.ndarray:
    """Return x, (n,), of least |slope x - value|^2 + damping |x|^2; slope: (m, n), value: (m,).

    Nakamura and Hanafusa (1986). The slope is not squared: links may be kilometres long.
    """
    count = slope.shape[1]
    stacked = np.vstack([slope, np.sqrt(damping) * np.eye(count)])
    return np.asarray(np.linalg.lstsq(stacked, np.append(value, np.zeros(count)))[0])


class _Search:
    """Damped least squares within limits."""

    def __init__(self, robot: Robot, frame: int, goal: pin.SE3, lower: np.ndarray, upper: np.ndarray) -> None:
        self._model, self._data, self._frame = robot.model, robot.model.createData(), frame
        self._goal, self._lower, self._upper = goal, lower, upper

    def left(self, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (6,) m and rad from the pose to the goal, and (6, n) its slope."""
        place = self.place(q)
        jacobian = np.reshape(pin.getFrameJacobian(self._model, self._data, self._frame, pin.LOCAL), (6, -1))
        left = self._goal.actInv(place)
        return np.asarray(pin.log6(left).vector), np.asarray(pin.Jlog6(left) @ jacobian)

    def place(self, q: np.ndarray) -> pin.SE3:
        """Return the link's placement."""
        pin.computeJointJacobians(self._model, self._data, q)
        return pin.updateFramePlacement(self._model, self._data, self._frame)

    def descend(self, q: np.ndarray) -> np.ndarray:
        """Return where the descent from `q` ends."""
        damping = _DAMPING
        value, slope = self.left(q)
        for _ in range(_STEPS):
            if np.linalg.norm(value) < _REACHED * 1e-2:
                break
            free = ~(((q <= self._lower) & (slope.T @ value > 0)) | ((q >= self._upper) & (slope.T @ value < 0)))
            part = slope[:, free]
            step = np.zeros_like(q)
            step[free] = -_damped_step(part, value, damping)
            tried = np.clip(q + step, self._lower, self._upper)
            new, new_slope = self.left(tried)
            if new @ new < value @ value:
                q, value, slope = tried, new, new_slope
                damping = max(damping * 0.2, _LEAST_DAMPING)
            else:
                damping *= 10
                if damping > 1e6:
                    break
        return q
