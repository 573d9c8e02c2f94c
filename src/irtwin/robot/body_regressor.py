"""The regressor of a robot's bodies for many samples at once: a loop over them takes longer and holds Python's lock.

Motions are followed from the base outwards as spatial vectors, each in the frame of its own body: three rows of a line,
three of a turn (Featherstone, Rigid Body Dynamics Algorithms, 2008). What a body's inertial parameters make of an axis'
torque is linear in them (Atkeson, An and Hollerbach 1986).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

_PIECE = 2048  # samples that are worked on at once: they stay in the processor's cache
_INERTIA = ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2))  # in Pinocchio's order


@dataclass(frozen=True)
class _Joint:
    """A joint that turns or `slides`: its parent's index (-1: the base) and its `axis` (6,), in its own frame.

    A motion of the parent is seen in the joint's frame by the `maps`, (6, 6) each: one as it is, one times the joint's
    position if it slides, or else its sine, and one times its cosine. `crossed` (6, 6) is a motion times the axis.
    """

    parent: int
    axis: np.ndarray
    maps: np.ndarray
    crossed: np.ndarray
    slides: bool

    def seen(self, motions: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return motions (m, 6, N) of the parent in the joint's frame, at positions (N,)."""
        still, *moved = (self.maps @ motions).reshape(len(motions), -1, *motions.shape[1:]).swapaxes(0, 1)
        for part, by in zip(moved, (q,) if self.slides else (np.sin(q), np.cos(q)), strict=True):
            part *= by
            still += part
        return np.asarray(still)


def body_regressor(model: pin.Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Return (N, n, 10 n): each joint's torque by ten inertial parameters a body, in Pinocchio's order.

    A column of a joint is one stretch of memory.
    """
    joints, count = _joints(model), model.nv
    found = np.zeros((count, 10 * count, len(q)))
    for first in range(0, len(q), _PIECE):
        cut = slice(first, first + _PIECE)
        states = (np.ascontiguousarray(each[cut].T) for each in (q, dq, ddq))
        _fill(found[:, :, cut], joints, model.gravity.vector, *states)
    return found.transpose(2, 0, 1)


def _joints(model: pin.Model) -> list[_Joint]:
    data = model.createData()
    pin.computeJointJacobians(model, data, np.zeros(model.nq))
    found = []
    for index in range(1, model.njoints):
        axis = np.reshape(pin.getJointJacobian(model, data, index, pin.LOCAL), (6, -1))[:, index - 1].copy()
        across = pin.Motion(axis).action  # of the axis, times a motion
        parent = model.jointPlacements[index].toActionMatrixInverse()
        slides = not axis[3:].any()
        # the exponential of -q times `across`, whose cube is 0 for a line and less itself for a turn
        series = [np.eye(6), -across] if slides else [np.eye(6) + across @ across, -across, -across @ across]
        maps = np.concatenate([part @ parent for part in series])
        found.append(_Joint(model.parents[index] - 1, axis, maps, -across, slides))
    return found


def _fill(
    found: np.ndarray, joints: Sequence[_Joint], gravity: np.ndarray, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray
) -> None:
    """Write the regressor (n, 10 n, N) of a few samples (n, N)."""
    still = np.zeros((6, q.shape[1]))
    base = np.stack([still, still - gravity[:, None]])
    motions: list[np.ndarray] = []  # of each body: speed, acceleration, and what a unit of speed of each carrier makes
    carriers: list[list[int]] = []
    for index, joint in enumerate(joints):
        before, carrying = (base, []) if joint.parent < 0 else (motions[joint.parent], carriers[joint.parent])
        own = np.concatenate([joint.seen(before, q[index]), np.broadcast_to(joint.axis[:, None], (1, *still.shape))])
        own[0] += joint.axis[:, None] * dq[index]
        own[1] += joint.axis[:, None] * ddq[index] + joint.crossed @ own[0] * dq[index]
        motions.append(own)
        carriers.append([*carrying, index])
        by_parameter = np.einsum("mkn,kpn->mpn", own[2:], _by_axis(own[0], own[1]))
        for carrier, torque in zip(carriers[-1], by_parameter, strict=True):
            found[carrier, 10 * index : 10 * index + 10] = torque


def _by_axis(speed: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Return (6, 10, N): what a body's parameters make of the torque of an axis, by the six numbers of the axis.

    speed, acceleration: (6, N), the latter less gravity.
    """
    w, dw = speed[3:], acceleration[3:]
    turning = _skew(w)
    a = acceleration[:3] + _times(turning, speed[:3])
    found = np.zeros((6, 10, speed.shape[1]))
    line, turn = found[:3], found[3:]
    line[:, 0] = a
    line[:, 1:4] = _skew(dw) + w[:, None] * w
    turn[:, 1:4] = -_skew(a)
    swept = turning[:, :, None] * w  # (3, 3, 3, N): by axis, and by row and column of the inertia
    squared = (w * w).sum(axis=0)
    for k in range(3):
        line[k, 1 + k] -= squared
        swept[k, k] += dw
    for place, (row, column) in enumerate(_INERTIA, start=4):
        turn[:, place] = swept[:, row, column]
        if row != column:
            turn[:, place] += swept[:, column, row]
    return found


def _skew(vector: np.ndarray) -> np.ndarray:
    """Return (3, 3, N) the matrices that multiply by vectors (3, N) from the left."""
    x, y, z = vector
    none = np.zeros_like(x)
    return np.array([[none, -z, y], [z, none, -x], [-y, x, none]])


def _times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("ikn,kn->in", matrix, vector))
