"""How far the rigid body and friction explain each torque, whatever the robot's parameters are."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pinocchio as pin

from irtwin.check.moving import Moving
from irtwin.robot.description import Robot

_REVERSAL = 0.1  # of a joint's usual speed: friction has its full size there
_INDEPENDENT = 1e-5  # of the largest singular value
_EXACT = 0.01  # of a torque's deviation: less is left in simulated logs alone, and means nothing


@dataclass(frozen=True)
class Rows:
    """N samples of a robot of n joints over all runs: motion and torque, each (N, n); time (N,) in its run, s."""

    robot: Robot
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray
    time: np.ndarray

    def changed(self, factors: np.ndarray, order: np.ndarray | None = None) -> Rows:
        """Return them with the positions of each joint times a factor (n,), then in another order (n,)."""
        order = np.arange(len(factors)) if order is None else order
        q, dq, ddq = ((values * factors)[:, order] for values in (self.q, self.dq, self.ddq))
        return replace(self, q=q, dq=dq, ddq=ddq)

    def nominal(self) -> np.ndarray:
        """Return the torque by the URDF's bodies, (N, n)."""
        data = self.robot.model.createData()
        return np.array([pin.rnea(self.robot.model, data, *state) for state in self._states()])

    def unexplained(self, joints: np.ndarray) -> np.ndarray:
        """Return (n, n): the share of torque b's deviation that the motion of joint a leaves.

        Bodies and friction are free. One where either is not among the `joints` (n,) bool.
        """
        data = self.robot.model.createData()
        regressors = np.array(
            [pin.computeJointTorqueRegressor(self.robot.model, data, *state) for state in self._states()]
        )
        shares = np.ones((len(joints), len(joints)))
        centred = self.torque - self.torque.mean(axis=0)
        sizes = np.sum(centred**2, axis=0)
        for a in np.flatnonzero(joints):
            columns = np.column_stack([regressors[:, a], friction(self.dq[:, a])])
            left = 1.0 - _explained(columns, centred) / np.where(sizes > 0, sizes, 1.0)
            shares[a] = np.where(joints & (sizes > 0), np.sqrt(np.maximum(left, 0.0)), 1.0)
        return np.clip(shares, _EXACT, 1.0)

    def explained(self, joint: int) -> np.ndarray:
        """Return an orthonormal basis (N, k) of what bodies and friction can explain of a joint's torque."""
        data = self.robot.model.createData()
        model, states = self.robot.model, self._states()
        regressors = [pin.computeJointTorqueRegressor(model, data, *state)[joint] for state in states]
        return _basis(np.column_stack([regressors, friction(self.dq[:, joint])]))

    def _states(self) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
        return list(zip(self.q, self.dq, self.ddq, strict=True))


def rows_of(robot: Robot, moving: Moving, most: int) -> Rows | None:
    """Return at most so many samples of the runs with torque; None where no run has it."""
    motions = [motion for motion in moving.motions if motion.torque is not None]
    if not motions:
        return None
    step = -(-sum(len(motion.time) for motion in motions) // most)
    fields = ("q", "dq", "ddq", "torque")
    q, dq, ddq, torque = (np.vstack([getattr(motion, name)[::step] for motion in motions]) for name in fields)
    return Rows(robot, q, dq, ddq, torque, np.concatenate([motion.time[::step] for motion in motions]))


def friction(speed: np.ndarray) -> np.ndarray:
    """Return columns (N, 3) of a joint's speed (N,): dry friction, viscous friction, an offset."""
    usual = float(np.sqrt(np.mean(speed**2))) or 1.0
    return np.column_stack([np.tanh(speed / (_REVERSAL * usual)), speed, np.ones(len(speed))])


def _explained(columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the part of the squares of values (N, n) that columns (N, K) explain, by their normal equations."""
    norms = np.linalg.norm(columns, axis=0)
    scaled = columns[:, norms > _INDEPENDENT * norms.max()] / norms[norms > _INDEPENDENT * norms.max()]
    sizes, directions = np.linalg.eigh(scaled.T @ scaled)
    used = sizes > _INDEPENDENT**2 * sizes[-1]
    return np.asarray(np.sum((directions[:, used].T @ (scaled.T @ values)) ** 2 / sizes[used, None], axis=0))


def _basis(columns: np.ndarray) -> np.ndarray:
    norms = np.linalg.norm(columns, axis=0)
    used = norms > _INDEPENDENT * norms.max()
    left, values, _ = np.linalg.svd(columns[:, used] / norms[used], full_matrices=False)
    return np.asarray(left[:, values > _INDEPENDENT * values[0]])
