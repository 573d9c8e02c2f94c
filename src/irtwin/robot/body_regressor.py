"""The regressor of a robot's bodies for many samples at once: a loop over them takes longer and holds Python's lock.

Motions are followed from the base outwards as spatial vectors, each in the frame of its own body: three rows of a line,
three of a turn (Featherstone, Rigid Body Dynamics Algorithms, 2008). What a body's inertial parameters make of an axis'
torque is linear in them (Atkeson, An and Hollerbach 1986).
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pinocchio as pin

from irtwin.robot.kinematics import joint_motions

_INERTIAS = np.zeros((6, 3, 3))  # a unit of each, in Pinocchio's order
for _unit, (_row, _column) in zip(_INERTIAS, ((0, 0), (0, 1), (1, 1), (0, 2), (1, 2), (2, 2)), strict=True):
    _unit[_row, _column] = _unit[_column, _row] = 1.0
_PIECE = 2500  # samples that are worked on at once, at most: they stay in the processor's cache


@dataclass(frozen=True)
class _Joint:
    """A joint that turns or `slides`: its parent's index (-1: the base) and its `axis` (6,), in its own frame.

    A motion of the parent is seen in the joint's frame by the `maps`, (6 + 2 r, 6): as it is, times the joint's
    position if it slides, or else its sine, and times its cosine. The latter two have the rows alone that are not
    zero: r of the six, `moved` of the line's three and of the turn's. `crossed` (6, 6) is a motion times the axis.
    """

    parent: int
    axis: np.ndarray
    maps: np.ndarray
    moved: slice
    crossed: np.ndarray
    slides: bool

    def seen(self, motions: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return motions (m, 6, N) of the parent in the joint's frame, at positions (N,), and last its axis."""
        count, samples = len(motions), motions.shape[2]
        seen = np.empty((count + 1, len(self.maps), samples))
        np.matmul(self.maps, motions, out=seen[:count])
        in_joint = seen[:, :6]
        parts = seen[:count, 6:].reshape(count, 2, 2, -1, samples)
        parts *= self._by(q)[:, None, None]
        rows = self._rows(in_joint[:count])
        rows += parts[:, 0]
        rows += parts[:, 1]
        in_joint[count] = self.axis[:, None]
        return in_joint

    def handed_down(self, slopes: np.ndarray, q: np.ndarray) -> np.ndarray:
        """Return slopes (m, 6, N) by motions seen in the joint's frame as slopes by those of the parent."""
        rows = self._rows(slopes).reshape(len(slopes), -1, slopes.shape[2])
        by_parent = self.maps[:6].T @ slopes
        for part, by in zip(self.maps[6:].reshape(2, -1, 6), self._by(q), strict=True):
            by_parent += part.T @ (rows * by)
        return np.asarray(by_parent)

    def _rows(self, motions: np.ndarray) -> np.ndarray:
        """Return the rows (m, 2, r / 2, N) of motions (m, 6, N) that depend on the joint's position."""
        return motions.reshape(len(motions), 2, 3, -1)[:, :, self.moved]

    def _by(self, q: np.ndarray) -> np.ndarray:
        """Return (2, N) what the maps that are not as they are go with."""
        return np.stack([q, np.zeros_like(q)] if self.slides else [np.sin(q), np.cos(q)])


def body_regressor(model: pin.Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Return (N, n, 10 n): each joint's torque by ten inertial parameters a body, in Pinocchio's order.

    A column of a joint is one stretch of memory.
    """
    joints, count = _joints(model), model.nv
    regressor = np.zeros((count, 10 * count, len(q)))
    for cut in _pieces(len(q)):
        states = (np.ascontiguousarray(signal[cut].T) for signal in (q, dq, ddq))
        for index, (own, chain) in enumerate(_motions(joints, model.gravity.vector, *states)):
            for carrier, torque in zip(chain, _torques(own), strict=True):
                regressor[carrier, 10 * index : 10 * index + 10, cut] = torque
    return regressor.transpose(2, 0, 1)


def carried_bodies(model: pin.Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return (N, 10 n) the sum over joints of `along` (N, n) times the regressor: power, if along is a speed.

    It takes one motion of each body instead of one for each joint that carries it.
    """
    joints = _joints(model)
    carried = np.empty((10 * model.nv, len(q)))
    for cut in _pieces(len(q)):
        states = (np.ascontiguousarray(signal[cut].T) for signal in (q, dq, ddq, along))
        for index, (own, _) in enumerate(_motions(joints, model.gravity.vector, *states)):
            carried[10 * index : 10 * index + 10, cut] = _torques(own)[0]
    return carried.T


def regressor_slope(
    model: pin.Model, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, weights: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the derivatives (N, n) of the sum of weights times regressor, (N, n, 10 n) both, by q, dq and ddq.

    They are worked out backwards from the tip to the base (reverse accumulation, Griewank and Walther 2008), which
    takes as long as a few regressors, where differences would take one for each joint.
    """
    joints = _joints(model)
    derivatives = np.empty((3, *q.shape))
    for cut in _pieces(len(q)):
        states = np.ascontiguousarray(np.stack([q[cut], dq[cut], ddq[cut]]).swapaxes(1, 2))
        slopes = _slope(joints, model.gravity.vector, states, weights[cut].transpose(1, 2, 0))
        derivatives[:, cut] = slopes.swapaxes(1, 2)
    return derivatives[0], derivatives[1], derivatives[2]


def point_jacobian(model: pin.Model, frame: int, q: np.ndarray) -> np.ndarray:
    """Return (N, n, 3): how fast a frame's origin moves along the base's axes by a unit of each joint's speed."""
    jacobian = np.zeros((len(q), model.nv, 3))
    joints, place = _joints(model), model.frames[frame].placement.translation
    chain = [index - 1 for index in model.supports[model.frames[frame].parentJoint] if index]
    lever = np.concatenate([np.eye(3), -pin.skew(place)], axis=1)
    for cut in _pieces(len(q)):
        states = np.ascontiguousarray(q[cut].T)
        # a motion along each of the base's axes, and what a unit of speed of each carrier makes
        motions = np.repeat(np.eye(6)[:3, :, None], states.shape[1], axis=2)
        for index in chain:
            motions = joints[index].seen(motions, states[index])
        along, carried = motions[:3, :3], lever @ motions[3:]
        jacobian[cut, chain] = np.einsum("akn,mkn->nma", along, carried)
    return jacobian


def _joints(model: pin.Model) -> list[_Joint]:
    joints = []
    for index, axis in enumerate(joint_motions(model), start=1):
        across = pin.Motion(axis).action  # of the axis, times a motion
        parent = model.jointPlacements[index].toActionMatrixInverse()
        slides = not axis[3:].any()
        # the exponential of -q times `across`, whose cube is 0 for a line and less itself for a turn
        still = np.eye(6) if slides else np.eye(6) + across @ across
        series = np.array([-across, -across @ across]).reshape(2, 2, 3, 6)
        first, second, last = np.flatnonzero(series.any(axis=(0, 1, 3)))[[0, 1, -1]].tolist()
        moved = slice(first, last + 1, second - first)  # two or three of three
        maps = np.concatenate([still, series[:, :, moved].reshape(-1, 6)]) @ parent
        joints.append(_Joint(model.parents[index] - 1, axis, maps, moved, -across, slides))
    return joints


def _pieces(samples: int) -> Iterator[slice]:
    """Yield the samples in pieces alike: a short one takes as many calls as a long one."""
    edges = np.linspace(0, samples, -(-samples // _PIECE) + 1).astype(int).tolist()
    return map(slice, edges[:-1], edges[1:])


def _motions(
    joints: Sequence[_Joint],
    gravity: np.ndarray,
    q: np.ndarray,
    dq: np.ndarray,
    ddq: np.ndarray,
    along: np.ndarray | None = None,
) -> list[tuple[np.ndarray, list[int]]]:
    """Return each body's motions (2 + c, 6, N) at a few samples (n, N), and the c joints that carry it.

    These are its speed, its acceleration less gravity, and what a unit of speed of each of the joints makes; or, third
    and last, what speeds `along` (n, N) make.
    """
    base = np.zeros((2 if along is None else 3, 6, q.shape[1]))
    base[1] -= gravity[:, None]
    motions: list[tuple[np.ndarray, list[int]]] = []
    for index, joint in enumerate(joints):
        before, carrying = (base, []) if joint.parent < 0 else motions[joint.parent]
        own = joint.seen(before, q[index])
        own[0] += own[-1] * dq[index]
        own[1] += own[-1] * ddq[index] + joint.crossed @ own[0] * dq[index]
        if along is not None:
            own[2] += own[3] * along[index]
            own = own[:3]
        motions.append((own, [*carrying, index]))
    return motions


def _slope(joints: Sequence[_Joint], gravity: np.ndarray, states: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Return the slopes (3, n, N) at a few samples' q, dq and ddq (3, n, N), by weights (n, 10 n, N)."""
    q, dq, ddq = states
    motions = _motions(joints, gravity, q, dq, ddq)
    slopes = [np.zeros_like(own) for own, _ in motions]  # of the sum, by each body's motions
    state_slopes = np.empty((3, *q.shape))
    for index, joint in reversed(list(enumerate(joints))):
        (own, chain), slope = motions[index], slopes[index]
        _add_torque_slope(slope, own, weights[chain, 10 * index : 10 * index + 10])
        turned = joint.crossed @ own[0]
        state_slopes[1, index] = np.einsum("kn,kn->n", turned, slope[1])
        slope[0] += joint.crossed.T @ slope[1] * dq[index]
        state_slopes[1, index] += joint.axis @ slope[0]
        state_slopes[2, index] = joint.axis @ slope[1]
        carried = own[:-1].copy()  # the joint's own axis does not depend on its position
        carried[1] -= turned * dq[index]
        state_slopes[0, index] = np.einsum("mkn,mkn->n", joint.crossed @ carried, slope[:-1])
        if joint.parent >= 0:
            slopes[joint.parent] += joint.handed_down(slope[:-1], q[index])
    return state_slopes


def _add_torque_slope(slope: np.ndarray, own: np.ndarray, weights: np.ndarray) -> None:
    """Add to `slope` how weights (c, 10, N) times a body's torques change with its motions, (2 + c, 6, N) both."""
    (speed, acceleration), carried = own[:2], own[2:]
    v, w, dw = speed[:3], speed[3:], acceleration[3:]
    a = acceleration[:3] + _cross(w, v)
    slope[2:, :3] += weights[:, 0, None] * a
    slope[2:] += np.einsum("kpn,mpn->mkn", _by_first_moments(a, w, dw), weights[:, 1:4])
    slope[2:, 3:] += np.einsum("kpn,mpn->mkn", _by_inertia(w, dw), weights[:, 4:])
    wrench = np.einsum("mpn,mkn->pkn", weights, carried)  # by which each parameter counts
    force, torque = wrench[1:4, :3], wrench[1:4, 3:]  # of first moments, whose unit vectors are the rows
    by_a = wrench[0, :3] - _axial(torque)
    by_w = np.einsum("pkn,pn->kn", force, w) + np.einsum("pkn,kn->pn", force, w) - 2 * np.einsum("ppn->n", force) * w
    by_dw = _axial(force)
    for parameter, inertia in zip(wrench[4:, 3:], _INERTIAS, strict=True):
        by_dw += inertia @ parameter
        by_w += _cross(inertia @ w, parameter) + inertia @ _cross(parameter, w)
    slope[0, :3] += _cross(by_a, w)
    slope[0, 3:] += by_w + _cross(v, by_a)
    slope[1, :3] += by_a
    slope[1, 3:] += by_dw


def _axial(rows: np.ndarray) -> np.ndarray:
    """Return (3, N) the sum of the unit vectors times the rows (3, 3, N)."""
    return np.array([rows[1, 2] - rows[2, 1], rows[2, 0] - rows[0, 2], rows[0, 1] - rows[1, 0]])


def _torques(own: np.ndarray) -> np.ndarray:
    """Return (m, 10, N): what a body's parameters make of the torque of m axes, by its motions (2 + m, 6, N).

    Mass acts along the line alone, inertia about the turn alone.
    """
    (speed, acceleration), carried = own[:2], own[2:]
    a = acceleration[:3] + _cross(speed[3:], speed[:3])
    torques = np.empty((len(carried), 10, speed.shape[1]))
    np.einsum("mkn,kn->mn", carried[:, :3], a, out=torques[:, 0])
    np.einsum("mkn,kpn->mpn", carried, _by_first_moments(a, speed[3:], acceleration[3:]), out=torques[:, 1:4])
    np.einsum("mkn,kpn->mpn", carried[:, 3:], _by_inertia(speed[3:], acceleration[3:]), out=torques[:, 4:])
    return torques


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


def _cross(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """Return the cross products (3, N): numpy's take twice as long."""
    return np.asarray(first[[1, 2, 0]] * second[[2, 0, 1]] - first[[2, 0, 1]] * second[[1, 2, 0]])


def _skew(vector: np.ndarray) -> np.ndarray:
    """Return (3, 3, N) the matrices that multiply by vectors (3, N) from the left."""
    x, y, z = vector
    none = np.zeros_like(x)
    return np.array([[none, -z, y], [z, none, -x], [-y, x, none]])
