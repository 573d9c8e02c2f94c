"""What a refit cannot imitate: a signal after projection on rigid body, rotor, friction and offset, plant-side."""

from __future__ import annotations

import mujoco
import numpy as np
import scipy

from irtwin.demo.plant.arm import Arm
from plant.near_zero import NearZero

BAND = 10.0  # Hz, above it a twin's filter leaves little
STRIDE = 4
SLOW = 0.02  # rad/s


def low_pass(signal: np.ndarray, interval: float) -> np.ndarray:
    """Return a signal (T, ...) without what lies above the band."""
    sections = scipy.signal.butter(4, BAND, fs=1 / interval, output="sos")
    return np.asarray(scipy.signal.sosfiltfilt(sections, signal, axis=0))


def rigid_body(arm: Arm, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> np.ndarray:
    """Return the torque's derivative by (m, mc, I) of every link: (N, n, 10 n), by Newton and Euler."""
    model, (rows, n) = arm.model, q.shape
    bodies = model.jnt_bodyid
    turn, place = np.tile(np.eye(3), (rows, 1, 1)), np.zeros((rows, 3))
    w, dw, a = np.zeros((rows, 3)), np.zeros((rows, 3)), np.tile([0.0, 0.0, 9.81], (rows, 1))
    axes, places = [], []
    out = np.zeros((rows, n, 10 * n))
    for joint in range(n):
        fixed = np.zeros(9)
        mujoco.mju_quat2Mat(fixed, model.body_quat[bodies[joint]])
        arm_vector = turn @ model.body_pos[bodies[joint]]
        a = a + np.cross(dw, arm_vector) + np.cross(w, np.cross(w, arm_vector))
        place = place + arm_vector
        turn = turn @ fixed.reshape(3, 3)
        local = model.jnt_axis[joint]
        axis = turn @ local
        dw = dw + axis * ddq[:, [joint]] + np.cross(w, axis) * dq[:, [joint]]
        w = w + axis * dq[:, [joint]]
        turn = turn @ _rotation(local, q[:, joint])
        axes.append(axis)
        places.append(place)
        force, moment = _link(turn, w, dw, a)
        for above in range(joint + 1):
            lever = np.cross((place - places[above])[:, None, :], force)
            out[:, above, 10 * joint : 10 * joint + 10] = np.einsum("rk,rck->rc", axes[above], moment + lever)
    return out


def _rotation(axis: np.ndarray, angle: np.ndarray) -> np.ndarray:
    x, y, z = axis
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.asarray(np.eye(3) + s * cross + (1 - c) * (cross @ cross))


def _link(turn: np.ndarray, w: np.ndarray, dw: np.ndarray, a: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment about the link's origin by its ten parameters, world frame: (N, 10, 3) each."""
    force, moment = np.zeros((len(w), 10, 3)), np.zeros((len(w), 10, 3))
    force[:, 0] = a
    for k in range(3):
        e = turn[:, :, k]
        force[:, 1 + k] = np.cross(dw, e) + np.cross(w, np.cross(w, e))
        moment[:, 1 + k] = np.cross(e, a)
    column = 4
    for k in range(3):
        for m in range(k, 3):
            ek, em = turn[:, :, k], turn[:, :, m]

            def times(v: np.ndarray, ek: np.ndarray = ek, em: np.ndarray = em, same: bool = k == m) -> np.ndarray:
                forth = ek * np.sum(em * v, axis=1, keepdims=True)
                return forth if same else forth + em * np.sum(ek * v, axis=1, keepdims=True)

            moment[:, column] = times(dw) + np.cross(w, times(w))
            column += 1
    return force, moment


class Basis:
    """The healthy twin's columns over all runs, ready to project on. Signals are (T, R, n), at the log's rate."""

    def __init__(
        self,
        arm: Arm,
        q: np.ndarray,
        dq: np.ndarray,
        ddq: np.ndarray,
        payload: np.ndarray,
        known: np.ndarray,
        weights: np.ndarray,
        interval: float,
        near_zero: NearZero | None = None,
    ) -> None:
        """`payload`: (R, 10) parameters told, `known`: (R,) mask of their runs, `weights`: (n,) 1 / noise."""
        dry = np.tanh(dq / 0.01) if near_zero is None else np.sign(dq) * near_zero.share(dq)
        self.interval = interval
        steps, runs, n = q.shape
        moving = np.abs(low_pass(dq, interval)[::STRIDE]) > SLOW  # at rest friction may hold anything
        self.weights = (moving * weights).reshape(-1, runs, n)
        flat = [x.reshape(-1, n) for x in (q, dq, ddq)]
        links = rigid_body(arm, *flat)
        told = np.tile(np.where(known[:, None], payload, 0), (steps, 1))
        carried = np.einsum("rjc,rc->rj", links[:, :, -10:], told)[:, :, None]
        links = np.concatenate([links, carried], axis=2).reshape(steps, runs, n, -1)
        links = low_pass(links, interval)[::STRIDE]
        own = np.zeros((*links.shape[:3], 4 * n))
        columns = np.stack([dry, dq, np.ones_like(q), ddq], axis=-1)
        columns = low_pass(columns, interval)[::STRIDE]
        for joint in range(n):
            own[:, :, joint, 4 * joint : 4 * joint + 4] = columns[:, :, joint]
        matrix = np.concatenate([links, own], axis=3) * self.weights[..., None]
        matrix = matrix.reshape(-1, matrix.shape[-1])
        scale = np.linalg.norm(matrix, axis=0)
        seen = scale > 1e-9 * scale.max()
        self.matrix = matrix[:, seen] / scale[seen]
        self.inverse = np.linalg.pinv(self.matrix.T @ self.matrix, rcond=1e-10, hermitian=True)

    def left(self, torque: np.ndarray) -> np.ndarray:
        """Return the part of a torque (T, R, n) that the columns cannot imitate: (T / stride, R, n) N m, 0 at rest."""
        y = (low_pass(torque, self.interval)[::STRIDE] * self.weights).reshape(-1)
        rest = (y - self.matrix @ (self.inverse @ (self.matrix.T @ y))).reshape(self.weights.shape)
        return np.divide(rest, self.weights, out=np.zeros_like(rest), where=self.weights > 0)
