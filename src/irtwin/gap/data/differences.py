"""A motion and its repeat, one laid on the other: what they differ by is no model's fault."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy

from irtwin.effects.friction import CoulombFriction
from irtwin.gap.thresholds import Data
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import interpolated

_FEWEST = 20  # samples that both have


@dataclass(frozen=True)
class Pair:
    """A motion and its repeat, which is `shift` s later; `inside` (N,): where both are known, on the first's times."""

    first: Motion
    second: Motion
    shift: float
    inside: np.ndarray

    @property
    def time(self) -> np.ndarray:
        """(M,) s of the first's clock, where both are known."""
        return np.asarray(self.first.time[self.inside])

    @property
    def moving(self) -> np.ndarray:
        """(M, n) where each joint moves in both: at rest friction holds what it has to, and no fit is asked there."""
        still = CoulombFriction().undecided
        there = interpolated(self.second.time + self.shift, still(self.second).astype(float), self.time)
        return np.asarray(~still(self.first)[self.inside] & (there == 0))

    def difference(self, signal: str) -> np.ndarray | None:
        """Return first less second of a signal, (M, ...), None where either lacks it."""
        first, second = getattr(self.first, signal), getattr(self.second, signal)
        return None if first is None or second is None else self.of(first, second)

    def of(self, first: np.ndarray, second: np.ndarray) -> np.ndarray:
        """Return the difference of what the first and the second have at their own times, (M, ...)."""
        return np.asarray(first[self.inside] - interpolated(self.second.time + self.shift, second, self.time))


def pairs_of(runs: Sequence[Run], motions: Mapping[str, Motion], limits: Data) -> list[Pair]:
    """Return each measured run that repeats another of its role, beside that one; a simulator repeats itself.

    `motions`: each run's, by name, filtered alike.
    """
    role = {run.name: run.role for run in runs if run.role != "simulated"}
    pairs = [
        _laid(motions[run.repeat_of], motions[run.name], limits)
        for run in runs
        if run.repeat_of and run.name in role and role.get(run.repeat_of) == run.role
    ]
    return [pair for pair in pairs if pair is not None]


def _laid(first: Motion, second: Motion, limits: Data) -> Pair | None:
    """Return the pair; None where they have too little in common."""
    shift = _shift(first, second)
    start = max(first.time[0], second.time[0] + shift) + 1e-9
    stop = min(first.time[-1], second.time[-1] + shift) - 1e-9
    inside = (first.time >= start) & (first.time <= stop)
    if inside.sum() < _FEWEST:
        return None
    q = scipy.interpolate.make_interp_spline(second.time + shift, second.q)(first.time[inside])
    if np.sqrt(np.mean((q - first.q[inside]) ** 2)) > limits.little * max(float(first.q.std()), 1e-3):
        return None
    return Pair(first, second, shift, inside)


def _shift(first: Motion, second: Motion) -> float:
    """Return by how much later (s) the second motion has to be moved to lie on the first: where speeds agree most."""
    spline = scipy.interpolate.make_interp_spline(second.time, second.q)
    even = np.arange(second.time[0], second.time[-1], 1 / first.rate)
    both = zip(first.dq.T, spline.derivative()(even).T, strict=True)
    agree = np.sum([scipy.signal.correlate(speed, other, method="fft") for speed, other in both], axis=0)
    lag = int(np.argmax(agree)) - (len(even) - 1)
    every = slice(None, None, max(1, len(first.time) // 500))
    time, q = first.time[every], first.q[every]

    def distance(shift: float) -> float:
        inside = (time - shift >= second.time[0]) & (time - shift <= second.time[-1])
        return float(np.mean((spline(time[inside] - shift) - q[inside]) ** 2)) if inside.any() else np.inf

    best, step = first.time[0] - second.time[0] + lag / first.rate, 2 / first.rate
    return float(scipy.optimize.minimize_scalar(distance, bounds=(best - step, best + step), method="bounded").x)
