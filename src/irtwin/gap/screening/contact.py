"""Episodes: contacts, told from one joint's troubles by what the other joints say of the force.

A force at the flange shows in every joint at once, through the Jacobian. In windows of each run's clock it is fitted to
all joints but one, and judged by what it predicts of that one's residual (contact detection on residuals: Haddadin,
De Luca, Albu-Schaeffer, IEEE Trans. Robotics 33(6), 2017; here without momentum, as accelerations are known offline).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from irtwin.effects.load import ExternalContact
from irtwin.gap.regression.correlation import correlation_samples
from irtwin.gap.screening.remainder import Remainder
from irtwin.gap.thresholds import Contact
from irtwin.identification.progress import Tell, paced
from irtwin.robot.description import Robot

_LENGTHS = (0.25, 0.375, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0)  # s
_STRIDE = 0.125  # s, between windows, or a quarter of their length
_STRETCH = 2.0  # s: of each the best window says what chance reaches
_SPREAD = 200.0  # N, of the force before any data
_SLOW = 0.02  # rad/s, across which friction changes its sign
_AT_ONCE = 4096  # windows
_SHARE = 0.02  # of the mean leverage: along what the other joints hardly feel, they say nothing

Clock = tuple[float, float]
"""Start and stop of the run's clock, s."""


def contact(
    robot: Robot, left: Sequence[Remainder], noise: np.ndarray, limits: Contact, tell: Tell | None = None
) -> ExternalContact | None:
    """Return the clearest contact, in all observed runs that show its force at its clock, to be tried as a cause.

    None where chance makes as much, and of an arm of one or two joints, of which hardly any agree. noise: (n,) RMS of
    each joint's residual, N m. `tell` is told how far that has come, where it takes long.
    """
    if len(robot.joints) < limits.fewest_joints:
        return None
    runs, told = [], paced(tell)
    for one in left:
        told(f"  contacts in {one.motion.run}")
        runs.append(_Run(one, ExternalContact().columns(robot, one.motion), noise, limits))
    return _contact(runs, limits, told)


def _contact(runs: Sequence[_Run], limits: Contact, told: Tell) -> ExternalContact | None:
    found = _leader(runs, told)
    if found is None:
        return None
    first, gain, clock = found
    quiet = [one for one in runs if one.judged(*one.samples(clock))[0].sum() < limits.quiet * gain]
    chance = _Chance.of(quiet or runs, clock, limits)
    members, p = _members(runs, first, clock, chance, limits)
    clock = _placed(members, clock)
    gains = np.concatenate([run.judged(*run.samples(clock))[0] for run in members])
    worse, better = -gains.clip(max=0.0).sum(), gains.clip(min=0.0).sum()
    if p * chance.p(gain, chance.count) > limits.alpha or worse > limits.harm * better:
        return None
    return ExternalContact(*clock, runs=tuple(sorted(run.name for run in members)))


def _leader(runs: Sequence[_Run], told: Tell) -> tuple[_Run, float, Clock] | None:
    """Return the observed run with the largest sudden gain, that gain, and its window."""
    found = None
    for run in runs:
        told(f"  windows of {run.name}")
        sudden = np.flatnonzero(run.sudden)
        if run.observed and len(sudden):
            window = int(sudden[np.argmax(run.gain[sudden])])
            if found is None or run.gain[window] > found[1]:
                found = run, float(run.gain[window]), run.clock(window)
    return found


def _members(
    runs: Sequence[_Run], first: _Run, clock: Clock, chance: _Chance, limits: Contact
) -> tuple[list[_Run], float]:
    """Return the runs that show the first one's force at its clock, and how likely chance makes the others of them.

    Each further motion makes chance as much less likely, of however many runs it was one.
    """
    _, force = first.judged(*first.samples(clock))
    members, others = [first], [run for run in runs if run.observed and run is not first and clock[1] <= run.time[-1]]
    p = 1.0
    for run in others:
        window = run.samples(clock)
        gains, own = run.judged(*window)
        alone = chance.p(float(gains.sum()), 1)
        if alone <= limits.alpha and run.explained(*window, force) >= limits.agreeing * run.explained(*window, own):
            if run.label not in [member.label for member in members]:
                p *= min(1.0, alone * len(others))
            members.append(run)
    return members, p


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
            sums = [sum(float(run.judged(*run.samples(one))[0].sum()) for run in members) for one in tried]
            clock = tried[int(np.argmax(sums))]
    return clock


@dataclass(frozen=True)
class _Chance:
    """What the best windows of stretches without the episode reach: its median, and the decay beyond, in logs."""

    middle: float
    decay: float
    count: int
    apart: float  # how many of the stretches are as if independent, by which the decay is known

    @classmethod
    def of(cls, runs: Sequence[_Run], clock: Clock, limits: Contact) -> _Chance:
        best = [value for run in runs for value in run.best_of_stretches(_away(run, clock))]
        logs = np.log(np.maximum(best, 1.0)) if best else np.zeros(1)
        middle, upper = np.quantile(logs, [0.5, 0.75])
        decay = max(limits.decay * float(upper - middle), limits.least_decay)
        memory = float(np.median([run.memory for run in runs]))
        apart = len(best) * min(1.0, _STRETCH / max(2 * memory, 1e-9))
        return cls(float(middle), decay, max(len(best), 1), max(apart, 1.0))

    def p(self, gain: float, count: int) -> float:
        """Return how likely chance reaches a gain in one of so many stretches.

        Beyond the median it decays exponentially; as the decay is known by few stretches, less than that.
        """
        above = max((np.log(max(gain, 1.0)) - self.middle) / self.decay, 0.0)
        return float(-np.expm1(count * np.log1p(-0.5 * (1 + above / self.apart) ** -self.apart)))


def _away(run: _Run, clock: Clock) -> np.ndarray:
    """Return (W,) which windows of a run lie apart from a stretch of the clock."""
    start, stop = run.time[run.windows[:, 0]], run.time[run.windows[:, 1] - 1]
    return np.asarray((stop < clock[0] - _STRIDE) | (start > clock[1] + _STRIDE))


class _Run:
    """One run's products of residual, Jacobian and friction, summed up to each sample.

    What friction explains is taken out first: it differs from run to run.
    """

    def __init__(self, left: Remainder, jacobian: np.ndarray, noise: np.ndarray, limits: Contact):
        """Take a remainder, the transposed Jacobian (N, n, 3) of its motion, and the noise (n,) N m."""
        self._limits = limits
        motion = left.motion
        self.name, self.label, self.time, self.observed = motion.run, left.label, motion.time, left.observed
        self.memory = float(np.median([correlation_samples(one) for one in left.residual.T])) / motion.rate  # s
        known = np.isfinite(left.residual)
        residual = np.where(known, left.residual, 0.0) / noise
        jacobian = np.where(known[:, :, None], jacobian, 0.0) / noise[:, None]
        speed = motion.dq
        friction = np.stack([np.ones_like(speed), speed, np.tanh(speed / _SLOW)], axis=2) * known[:, :, None]
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
            if 2 <= size <= self._limits.longest * len(self.time):
                starts = np.arange(0, len(self.time) - size, max(1, int(max(_STRIDE, length / 8) / step)))
                parts.append(np.column_stack([starts, starts + size]))
        return np.concatenate(parts)

    @cached_property
    def gain(self) -> np.ndarray:
        """(W,) what a force in each window explains of all joints, each predicted from the others."""
        parts = np.array_split(self.windows, max(1, len(self.windows) // _AT_ONCE))
        return np.concatenate([self.judged(*part.T)[0].sum(axis=1) for part in parts])

    @cached_property
    def sudden(self) -> np.ndarray:
        """(W,) whether one force over the whole run explains much less: a payload or a tilted base is no transient."""
        whole = float(self.judged(np.array([0]), np.array([len(self.time)]))[0].sum())
        return np.asarray(whole <= self._limits.steady * self.gain)

    def clock(self, window: int) -> Clock:
        """Return a window's start and stop, s."""
        start, stop = self.windows[window]
        return float(self.time[start]), float(self.time[stop - 1])

    def samples(self, clock: Clock) -> tuple[np.ndarray, np.ndarray]:
        """Return the first and the last (exclusive) sample of a stretch of the clock, (1,) each."""
        start = np.searchsorted(self.time, clock[0])
        return np.array([start]), np.array([np.searchsorted(self.time, clock[1], side="right")])

    def best_of_stretches(self, free: np.ndarray) -> list[float]:
        """Return the largest gain of the free windows about each stretch of the clock."""
        middle = self.time[self.windows.sum(axis=1) // 2]
        place = ((middle - self.time[0]) / _STRETCH).astype(int)
        return [float(self.gain[inside].max()) for k in np.unique(place) if (inside := free & (place == k)).any()]

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
