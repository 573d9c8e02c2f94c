"""How far the rigid body and friction explain each torque, whatever the robot's parameters are, however it is built."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from irtwin.check.moving import Moving
from irtwin.robot.body_regressor import body_regressor
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import joint_motions
from irtwin.robot.model import inverse_dynamics
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import interpolated

FEW_ROWS, MANY_ROWS = 900, 1500  # over all runs, of which a fault is looked for
MOST_JOINTS = 12  # of more no fault is looked for that takes fits of the whole body
_FEWEST = 300  # samples; fewer, and regressors of chance explain everything
_REVERSAL = 0.1  # of a joint's usual speed: friction has its full size there
_INDEPENDENT = 1e-5  # of the largest singular value
_EXACT = 0.01  # of a torque's deviation: less is left in simulated logs alone, and means nothing


@dataclass(frozen=True)
class RigidBodyRows:
    """N samples of a robot of n joints over all runs: motion and torque, each (N, n)."""

    model: pin.Model
    q: np.ndarray
    dq: np.ndarray
    ddq: np.ndarray
    torque: np.ndarray

    def nominal(self) -> np.ndarray:
        """Return the torque by the URDF's bodies, (N, n)."""
        return inverse_dynamics(self.model, self.q, self.dq, self.ddq)

    def columns(self) -> np.ndarray:
        """Return what bodies and, at each joint for itself, rotor and friction add to the torques, (N, n, 14 n)."""
        count, n = self.q.shape
        columns = np.zeros((count, n, 14 * n))
        columns[:, :, : 10 * n] = self._regressors()
        for joint in range(n):
            own = np.column_stack([self.ddq[:, joint], friction(self.dq[:, joint])])
            columns[:, joint, 10 * n + 4 * joint : 10 * n + 4 * joint + 4] = own
        return columns

    def unexplained(self, joints: np.ndarray) -> np.ndarray:
        """Return (n, n): the share of torque b's deviation that the motion of joint a leaves.

        Bodies and friction are free. One where either is not among the `joints` (n,) bool.
        """
        regressors = self._regressors()
        shares = np.ones((len(joints), len(joints)))
        centred = self.torque - self.torque.mean(axis=0)
        sizes = np.sum(centred**2, axis=0)
        for a in np.flatnonzero(joints):
            columns = np.column_stack([regressors[:, a], friction(self.dq[:, a])])
            left = 1.0 - _explained(columns, centred) / np.where(sizes > 0, sizes, 1.0)
            shares[a] = np.where(joints & (sizes > 0), np.sqrt(np.maximum(left, 0.0)), 1.0)
        return np.clip(shares, _EXACT, 1.0)

    def _regressors(self) -> np.ndarray:
        return body_regressor(self.model, self.q, self.dq, self.ddq)


def rows_of(
    robot: Robot, moving: Moving, most: int, later: float = 0.0, of_torque: float = 0.0
) -> RigidBodyRows | None:
    """Return at most so many samples of the runs with torque, of the payload that most have; None where they are few.

    `later`, `of_torque`: by how much (s) the motion, and the torque, are those of a later time.
    """
    motions = _alike([motion for motion in moving.motions if motion.torque is not None])
    step = -(-sum(len(motion.time) for motion in motions) // most)
    if sum(len(motion.time[::step]) for motion in motions) < _FEWEST:
        return None
    q, dq, ddq, torque = (
        np.vstack([interpolated(motion.time, getattr(motion, name), motion.time[::step] + by) for motion in motions])
        for name, by in (("q", later), ("dq", later), ("ddq", later), ("torque", of_torque))
    )
    return RigidBodyRows(robot.model, q, dq, ddq, torque)


def _alike(motions: list[Motion]) -> list[Motion]:
    """Return those of the payload that was carried longest: another is another body."""
    carried: dict[tuple[float, ...], list[Motion]] = {}
    for motion in motions:
        carried.setdefault((motion.payload_mass, *motion.payload_com), []).append(motion)
    return max(carried.values(), key=lambda alike: sum(len(motion.time) for motion in alike), default=[])


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
