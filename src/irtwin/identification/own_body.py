"""What an exciting motion must keep to beside its walls: the robot's own body, and the torque of its joints."""

from __future__ import annotations

import numpy as np

from irtwin.errors import InputError
from irtwin.identification.fourier_series import FourierSeries
from irtwin.robot.collision import CollisionModel
from irtwin.robot.description import Robot
from irtwin.robot.model import inverse_dynamics

_FINER = 4  # poses between two instants of a series' grid
_NEAR = 0.05  # m: nearer pairs push one another off
_KEEP_OFF = 0.005  # m: what poses keep, for what lies between them
_TORQUE = 0.95  # share of the torque limits that is used
_PROOF = 1e-3  # s between the instants of the proof


class OwnBody:
    """The collision shapes of a robot of n joints, and its torque limits by the bodies of its URDF."""

    def __init__(self, robot: Robot) -> None:
        self._robot = robot
        self._collisions = CollisionModel(robot)
        self._checked = self._collisions.checks_itself
        self._limits = np.array([joint.effort for joint in robot.joints])

    def postures(self, q: np.ndarray) -> np.ndarray:
        """Return those of postures (p, n) that touch nothing and can be held. Raise InputError where none is."""
        held = q[self._torque_share(q, 0 * q, 0 * q) < _TORQUE]
        if not len(held):
            raise InputError(
                f"{self._robot.name}: holding the arm takes more than the torque limits in every posture that was "
                "tried; correct the masses or the efforts in the URDF"
            )
        self._collisions.keep_off(_KEEP_OFF)
        free = held[[not self._collisions.touches(pose) for pose in held]]
        if not len(free):
            raise InputError(
                f"{self._robot.name}: the robot meets itself in every posture that was tried; correct its collision "
                "shapes in the URDF"
            )
        return np.asarray(free)

    def allows(self, series: FourierSeries) -> bool:
        """Return whether the motion touches nothing and keeps its torque, at dense instants of a period."""
        grid = series.grid()
        time = np.linspace(0, series.period, _FINER * len(grid), endpoint=False)
        q, dq, ddq = series.motion(time)
        self._collisions.keep_off(_KEEP_OFF)
        return bool((self._torque_share(q, dq, ddq) < _TORQUE).all()) and not any(map(self._collisions.touches, q))

    def proves(self, series: FourierSeries) -> bool:
        """Return whether nothing touches at any time, checked every millimetre of the fastest point."""
        time = np.linspace(0, series.period, 1 + round(series.period / _PROOF))
        self._collisions.keep_off(0.0)
        return self._collisions.first_meeting(time, series.motion(time)[0])[0] is None

    def barrier(self, q: np.ndarray) -> tuple[float, np.ndarray]:
        """Return a sum over poses (N, n) that grows without bound where pairs come near, and its slope (N, n)."""
        value, slope = 0.0, np.zeros_like(q)
        if not self._checked:
            return value, slope
        self._collisions.keep_off(_KEEP_OFF + _NEAR)
        near = [row for row, pose in enumerate(q) if self._collisions.touches(pose)]
        for row in near:
            clearance, change = self._collisions.clearance_slope(q[row])
            share = (clearance - _KEEP_OFF) / _NEAR
            if share <= 0:
                return np.inf, slope
            value += share - 1 - np.log(share)
            slope[row] = (1 - 1 / share) * change / _NEAR
        return value, slope

    def _torque_share(self, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
        """Return the greatest share of a torque limit, (N,)."""
        if not np.isfinite(self._limits).any():
            return np.zeros(len(q))
        return np.asarray((np.abs(inverse_dynamics(self._robot.model, q, dq, ddq)) / self._limits).max(axis=1))
