"""Ripples: at which joints each known order is tried, and the order of each joint's clearest fast one."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.effects.effect import Effect
from irtwin.effects.transmission import SLOW_ORDERS, TorqueRipple
from irtwin.gap.screening.remainder import RunResidual
from irtwin.identification.progress import track
from irtwin.robot.description import Robot

_TURN = 4096  # parts of a turn by which angles are told apart: ten a period at the fastest
_FINE = 4  # points of the spectrum for each that is independent


def known_ripples(robot: Robot, left: Sequence[RunResidual]) -> list[Effect]:
    """Return the ripples of known orders, each at the joints that move through one of its periods in observed runs.

    Within less than a period a ripple is any curve over the angle: also that of a hose, which stiffens.
    """
    angles = [run.motion.q for run in left if run.observed]
    turns = np.ptp(np.concatenate(angles), axis=0) / (2 * np.pi) if angles else np.zeros(len(robot.joints))
    ripples = []
    for ripple in TorqueRipple().candidates(robot):
        periods = turns * ripple.shape["N"]
        joints = tuple(name for name, many in zip(robot.joint_names, periods, strict=True) if many >= 1)
        if joints:
            ripples.append(ripple.on(*joints))
    return ripples


def fast_ripples(robot: Robot, left: Sequence[RunResidual]) -> list[TorqueRipple]:
    """Return for each joint the ripple beyond the slow orders that explains most of its residual in observed runs.

    Slow orders are tried one by one; of the fast ones there are too many, and a line is told from its neighbours only
    as finely as the joint turns far.
    """
    ripples = []
    for joint, name in track(enumerate(robot.joint_names), lambda numbered: f"ripples of {numbered[1]}"):
        parts = [(run.motion.q[:, joint], run.residual[:, joint]) for run in left if run.observed]
        angle, residual = (np.concatenate([part[k] for part in parts] or [np.zeros(0)]) for k in range(2))
        kept = np.isfinite(residual)
        order = _clearest(angle[kept], residual[kept])
        if order is not None:
            ripples.append(TorqueRipple(N=order, joints=(name,)))
    return ripples


def _clearest(angle: np.ndarray, residual: np.ndarray) -> float | None:
    """Return the order, a turn, of the strongest line among fast ones; None where there is none.

    Sums over parts of a turn take the place of the samples, so that a Fourier transform gives all orders at once.
    """
    if not residual.any():
        return None
    part = np.floor((angle - angle.min()) / (2 * np.pi) * _TURN).astype(int)
    sums = np.bincount(part, residual)
    length = _TURN * _FINE * max(1, -(-len(sums) // _TURN))
    orders = np.fft.rfftfreq(length, 1 / _TURN)
    height = np.abs(np.fft.rfft(sums, length))
    lines = 1 + np.flatnonzero((height[1:-1] > height[:-2]) & (height[1:-1] > height[2:]))
    fast = [k for k in lines if max(SLOW_ORDERS) < orders[k] <= TorqueRipple.ranges["N"][1]]
    return float(orders[max(fast, key=lambda k: height[k])]) if fast else None
