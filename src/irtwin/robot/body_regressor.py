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


def point_jacobian(model: pin.Model, frame: int, q: np.ndarray) -> np.ndarray:
    """Return (N, n, 3): how fast a frame's origin moves along the base's axes by a unit of each joint's speed."""
    found = np.zeros((len(q), model.nv, 3))
    joints, place = _joints(model), model.frames[frame].placement.translation
    chain = [index - 1 for index in model.supports[model.frames[frame].parentJoint] if index]
    lever = np.concatenate([np.eye(3), -pin.skew(place)], axis=1)
    for first in range(0, len(q), _PIECE):
        cut = slice(first, first + _PIECE)
        states = np.ascontiguousarray(q[cut].T)
        # a motion along each of the base's axes, and what a unit of speed of each carrier makes
        motions = np.repeat(np.eye(6)[:3, :, None], states.shape[1], axis=2)
        for index in chain:
            axis = np.broadcast_to(joints[index].axis[:, None], (1, 6, states.shape[1]))
            motions = np.concatenate([joints[index].seen(motions, states[index]), axis])
        along, carried = motions[:3, :3], lever @ motions[3:]
        found[cut, chain] = np.einsum("akn,mkn->nma", along, carried)
    return found


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
        for carrier, torque in zip(carriers[-1], _torques(own[2:], own[0], own[1]), strict=True):
            found[carrier, 10 * index : 10 * index + 10] = torque


def _torques(carried: np.ndarray, speed: np.ndarray, acceleration: np.ndarray) -> np.ndarray:
    """Return (m, 10, N): what a body's parameters make of the torque of m axes.

    carried: (m, 6, N), what a unit of each axis' speed makes of the body's motion; speed, acceleration: (6, N) of the
    body, the latter less gravity. Mass acts along the line alone, inertia about the turn alone.
    """
    a = acceleration[:3] + _times(_skew(speed[3:]), speed[:3])
    found = np.empty((len(carried), 10, speed.shape[1]))
    np.einsum("mkn,kn->mn", carried[:, :3], a, out=found[:, 0])
    np.einsum("mkn,kpn->mpn", carried, _by_first_moments(a, speed[3:], acceleration[3:]), out=found[:, 1:4])
    np.einsum("mkn,kpn->mpn", carried[:, 3:], _by_inertia(speed[3:], acceleration[3:]), out=found[:, 4:])
    return found


def _by_first_moments(a: np.ndarray, w: np.ndarray, dw: np.ndarray) -> np.ndarray:
    """Return (6, 3, N): force w x (w x c) + dw x c and torque c x a of three first moments c."""
    x, y, z = w
    xx, yy, zz = w * w
    return np.array(
        [
            [-yy - zz, x * y - dw[2], x * z + dw[1]],
            [x * y + dw[2], -xx - zz, y * z - dw[0]],
            [x * z - dw[1], y * z + dw[0], -xx - yy],
            *-_skew(a),
        ]
    )


def _by_inertia(w: np.ndarray, dw: np.ndarray) -> np.ndarray:
    """Return (3, 6, N): torque I dw + w x I w of six numbers of the inertia I, in Pinocchio's order."""
    x, y, z = w
    xx, yy, zz = w * w
    xy, xz, yz = x * y, x * z, y * z
    return np.array(
        [
            [dw[0], dw[1] - xz, -yz, dw[2] + xy, yy - zz, yz],
            [xz, dw[0] + yz, dw[1], zz - xx, dw[2] - xy, -xz],
            [-xy, xx - yy, xy, dw[0] - yz, dw[1] + xz, dw[2]],
        ]
    )


def _skew(vector: np.ndarray) -> np.ndarray:
    """Return (3, 3, N) the matrices that multiply by vectors (3, N) from the left."""
    x, y, z = vector
    none = np.zeros_like(x)
    return np.array([[none, -z, y], [z, none, -x], [-y, x, none]])


def _times(matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("ikn,kn->in", matrix, vector))
