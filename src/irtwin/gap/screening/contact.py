"""Episodes: contacts, told from one joint's troubles by what the other joints say of the force.

A force at the flange shows in every joint at once, through the Jacobian. In windows of each run's clock it is fitted to
all joints but one, and judged by what it predicts of that one's residual (contact detection on residuals: Haddadin,
De Luca, Albu-Schaeffer, IEEE Trans. Robotics 33(6), 2017; here without momentum, as accelerations are known offline).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np

from irtwin.effects.friction import SLOW
from irtwin.effects.load import ExternalContact
from irtwin.gap.screening.remainder import RunResidual
from irtwin.identification.progress import track
from irtwin.robot.description import Robot

_FEWEST_JOINTS = 3  # of fewer, hardly any agree on a force
_LONGEST = 0.7  # of a run: what lasts longer is no episode
_LENGTHS = (0.25, 0.375, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)  # s
_STRIDE = 0.125  # s, between windows, or a quarter of their length
_SPREAD = 200.0  # N, of the force before any data
_AT_ONCE = 4096  # windows
_SHARE = 0.02  # of the mean leverage: along what the other joints hardly feel, they say nothing

Clock = tuple[float, float]
"""Start and stop of the run's clock, s."""


def contact(robot: Robot, left: Sequence[RunResidual], noise: np.ndarray) -> ExternalContact | None:
    """Return the clearest contact, in all observed runs that show its force at its clock, to be tried as a cause.

    None of an arm of one or two joints, of which hardly any agree. noise: (n,) RMS of each joint's residual, N m.
    """
    if len(robot.joints) < _FEWEST_JOINTS:
        return None
    observed = track([run for run in left if run.observed], lambda current: f"contacts in {current.motion.run}")
    runs = [_Run(run, ExternalContact().columns(robot, run.motion), noise) for run in observed]
    leader = _leader(runs)
    if leader is None:
        return None
    first, clock = leader
    _, force = first.judged(*first.samples(clock))
    members = [run for run in runs if run is first or run.explained(*run.samples(clock), force) > 0]
    return ExternalContact(*_placed(members, clock), runs=tuple(sorted(run.name for run in members)))


def _leader(runs: Sequence[_Run]) -> tuple[_Run, Clock] | None:
    """Return the run with the largest sudden gain, and its window."""
    best, leader = 0.0, None
    for run in track(runs, lambda current: f"windows of {current.name}"):
        gain = np.where(run.gain > run.throughout, run.gain, 0.0)
        if len(gain) and gain.max() > best:
            best, leader = float(gain.max()), (run, run.clock(int(np.argmax(gain))))
    return leader


def _placed(members: Sequence[_Run], clock: Clock) -> Clock:
    """Move start and stop, one after the other, to where the runs' gain is largest."""
    for step in (_STRIDE, _STRIDE / 2, _STRIDE / 4):
        for end in (0, 1, 0, 1):
            tried = [clock]
            for k in range(-4, 5):
                moved = list(clock)
                moved[end] += k * step
                if moved[1] - moved[0] >= _LENGTHS[0]:
                    tried.append((moved[0], moved[1]))
            sums = [sum(float(run.judged(*run.samples(window))[0].sum()) for run in members) for window in tried]
            clock = tried[int(np.argmax(sums))]
    return clock


class _Run:
    """One run's products of residual, Jacobian and friction, summed up to each sample.

    What friction explains is taken out first: it differs from run to run.
    """

    def __init__(self, left: RunResidual, jacobian: np.ndarray, noise: np.ndarray):
        """Take a remainder, the transposed Jacobian (N, n, 3) of its motion, and the noise (n,) N m."""
        motion = left.motion
        self.name, self.time = motion.run, motion.time
        known = np.isfinite(left.residual)
        residual = np.where(known, left.residual, 0.0) / noise
        jacobian = np.where(known[:, :, None], jacobian, 0.0) / noise[:, None]
        speed = motion.dq
        friction = np.stack([np.ones_like(speed), speed, np.tanh(speed / SLOW)], axis=2) * known[:, :, None]
        self._inverse = np.linalg.inv(np.einsum("tjk,tjl->jkl", friction, friction) + 1e-6 * np.eye(3))
        taken = np.einsum("jkl,tj,tjl->jk", self._inverse, residual, friction)
        residual = residual - np.einsum("tjk,jk->tj", friction, taken)
        self._squares = _summed(np.einsum("tja,tjb->tjab", jacobian, jacobian))
        self._right = _summed(jacobian * residual[:, :, None])
        self._cross = _summed(np.einsum("tjk,tja->tjka", friction, jacobian))

    @cached_property
    def windows(self) -> np.ndarray:
        """(W, 2) first and last (exclusive) samples of the windows."""
        step = float(np.median(np.diff(self.time)))
        parts = [np.zeros((0, 2), dtype=int)]
        for length in _LENGTHS:
            size = round(length / step)
            if 2 <= size <= _LONGEST * len(self.time):
                starts = np.arange(0, len(self.time) - size, max(1, int(max(_STRIDE, length / 8) / step)))
                parts.append(np.column_stack([starts, starts + size]))
        return np.concatenate(parts)

    @cached_property
    def gain(self) -> np.ndarray:
        """(W,) what a force in each window explains of all joints, each predicted from the others."""
        parts = np.array_split(self.windows, max(1, len(self.windows) // _AT_ONCE))
        return np.concatenate([self.judged(*part.T)[0].sum(axis=1) for part in parts])

    @cached_property
    def throughout(self) -> float:
        """What one force over the whole run gains: a payload or a tilted base is no transient."""
        return float(self.judged(np.array([0]), np.array([len(self.time)]))[0].sum())

    def clock(self, window: int) -> Clock:
        """Return a window's start and stop, s."""
        start, stop = self.windows[window]
        return float(self.time[start]), float(self.time[stop - 1])

    def samples(self, clock: Clock) -> tuple[np.ndarray, np.ndarray]:
        """Return the first and the last (exclusive) sample of a stretch of the clock, (1,) each."""
        start = np.searchsorted(self.time, clock[0])
        return np.array([start]), np.array([np.searchsorted(self.time, clock[1], side="right")])

    def judged(self, start: np.ndarray, stop: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return (W, n) what joints gain by the force that the others say, and (W, 3) the force that all say, N."""
        squares, right = self._window(start, stop)
        whole, target = squares.sum(axis=1), right.sum(axis=1)
        prior = _SHARE * np.trace(whole, axis1=1, axis2=2)[:, None, None] * np.eye(3) + np.eye(3) / _SPREAD**2
        others = np.linalg.solve((whole + prior)[:, None] - squares, (target[:, None] - right)[..., None])[..., 0]
        gain = 2 * np.einsum("wja,wja->wj", others, right) - np.einsum("wja,wjab,wjb->wj", others, squares, others)
        return gain, np.linalg.solve(whole + prior, target[..., None])[..., 0]

    def explained(self, start: np.ndarray, stop: np.ndarray, force: np.ndarray) -> float:
        """Return the squares that a known force (1, 3) explains in a window of all joints."""
        squares, right = (part.sum(axis=1)[0] for part in self._window(start, stop))
        return float(2 * force[0] @ right - force[0] @ squares @ force[0])

    def _window(self, start: np.ndarray, stop: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return each joint's products in windows, (W, n, 3, 3), and with the residual, (W, n, 3)."""
        cross = self._cross[stop] - self._cross[start]
        imitated = np.einsum("wjka,jkl,wjlb->wjab", cross, self._inverse, cross)
        return self._squares[stop] - self._squares[start] - imitated, self._right[stop] - self._right[start]


def _summed(products: np.ndarray) -> np.ndarray:
    return np.concatenate([np.zeros((1, *products.shape[1:])), np.cumsum(products, axis=0)])
