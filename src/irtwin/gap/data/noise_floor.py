"""The noise floor: what no model of the motion could explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.interpolate import make_interp_spline
from scipy.optimize import minimize_scalar
from scipy.signal import welch

from irtwin.gap.thresholds import Repeats
from irtwin.signals.filter import kernel, low_pass
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion

REPEATS, OUT_OF_BAND = "repeats", "out_of_band"
_LEAST = 1e-9  # N m or W: of a channel that repeats itself to the last bit
_WELCH = 512  # samples of a stretch whose spectrum is averaged


@dataclass(frozen=True)
class Floor:
    """RMS of the noise in the filter's band: torque (n,) N m, power W; None where it was not measured or unknown.

    `source` is "repeats", "out_of_band", or None where neither could tell.
    """

    torque: np.ndarray | None
    power: float | None
    source: str | None


def noise_floor(runs: Sequence[Run], motions: Mapping[str, Motion], limits: Repeats) -> Floor:
    """Return the floor: from repeats of one motion where there are any, else from above the band.

    A simulator's runs say nothing of it: they have no noise, and repeat themselves.
    `motions`: each run's, by name, filtered alike. Repeats: RMS of the aligned difference / sqrt(2), pooled.
    Above the band: what the filter took away, taken as white, scaled to the band. This misses noise that is
    coloured, so it is the smaller of the two. A run that was smoothed before it was logged tells nothing.
    """
    runs = [run for run in runs if run.role != "simulated"]
    pairs = [(motions[run.repeat_of], motions[run.name]) for run in runs if run.repeat_of and _has_repeat(run, runs)]
    torque = _pooled([_difference(a, b, "torque", limits) for a, b in pairs])
    power = _pooled([_difference(a, b, "power", limits) for a, b in pairs])
    if torque is not None or power is not None:
        return Floor(torque, None if power is None else float(power[0]), REPEATS)
    torque = _pooled([_above(run.signals.time, run.signals.torque, motions[run.name], limits) for run in runs])
    power = _pooled([_above(run.signals.time, run.signals.power, motions[run.name], limits) for run in runs])
    source = None if torque is None and power is None else OUT_OF_BAND
    return Floor(torque, None if power is None else float(power[0]), source)


def _has_repeat(run: Run, runs: Sequence[Run]) -> bool:
    return any(other.name == run.repeat_of and other.role == run.role for other in runs)


def _pooled(variances: Sequence[np.ndarray | None]) -> np.ndarray | None:
    """Return the RMS of all runs (n,), None where some joint's is known of none."""
    known = np.array([variance for variance in variances if variance is not None])
    if not len(known) or np.isnan(known).all(axis=0).any():
        return None
    return np.asarray(np.maximum(np.sqrt(np.nanmean(known, axis=0)), _LEAST))


def _difference(first: Motion, second: Motion, signal: str, limits: Repeats) -> np.ndarray | None:
    """Return half the mean square difference of two runs of one motion, (n,) or (1,)."""
    one, two = getattr(first, signal), getattr(second, signal)
    if one is None or two is None:
        return None
    shift = _shift(first, second, limits.largest_shift)
    start = max(first.time[0], second.time[0] + shift) + 1e-9
    stop = min(first.time[-1], second.time[-1] + shift) - 1e-9
    inside = (first.time >= start) & (first.time <= stop)
    if inside.sum() < 20:
        return None
    time = first.time[inside]
    q = make_interp_spline(second.time + shift, second.q)(time)
    if np.sqrt(np.mean((q - first.q[inside]) ** 2)) > limits.largest_difference * max(float(first.q.std()), 1e-3):
        return None
    again = make_interp_spline(second.time + shift, two, k=1)(time)
    squares = (one[inside] - again) ** 2 / 2
    return np.atleast_1d(np.mean(_without_jumps(squares), axis=0))


def _without_jumps(squares: np.ndarray) -> np.ndarray:
    """Cap the one percent largest: repeats change the sign of friction at slightly different instants."""
    return np.asarray(np.minimum(squares, np.quantile(squares, 0.99, axis=0)))


def _shift(first: Motion, second: Motion, largest: float) -> float:
    """Return by how much later (s) the second motion has to be moved to lie on the first."""
    spline = make_interp_spline(second.time, second.q)
    low, high = second.time[0], second.time[-1]
    every = slice(None, None, max(1, len(first.time) // 500))
    time, q = first.time[every], first.q[every]

    def distance(shift: float) -> float:
        inside = (time - shift >= low) & (time - shift <= high)
        return float(np.mean((spline(time[inside] - shift) - q[inside]) ** 2)) if inside.any() else np.inf

    offset = first.time[0] - second.time[0]
    grid = offset + np.linspace(-largest, largest, 81)
    best = grid[int(np.argmin([distance(shift) for shift in grid]))]
    step = grid[1] - grid[0]
    return float(minimize_scalar(distance, bounds=(best - step, best + step), method="bounded").x)


def _above(time: np.ndarray, signal: np.ndarray | None, motion: Motion, limits: Repeats) -> np.ndarray | None:
    """Return the variance in the band of white noise that has above it what the filter takes away; NaN if smoothed."""
    if signal is None or motion.cutoff is None or len(kernel(motion.rate, motion.cutoff)) == 1:
        return None
    share = min(1.0, limits.stop_band * motion.cutoff / (motion.rate / 2))
    if share > 0.9:
        return None
    even = make_interp_spline(time, signal, k=1)(motion.time)
    above = even - low_pass(even, motion.rate, motion.cutoff)
    variance = np.median(above**2, axis=0) / 0.4549 * share / (1 - share)
    return np.atleast_1d(np.where(_smoothed(even, motion.rate, share * motion.rate / 2, limits), np.nan, variance))


def _smoothed(signal: np.ndarray, rate: float, stop: float, limits: Repeats) -> np.ndarray:
    """Return whether the spectrum of a signal, from `stop` (Hz) on, falls up to its very end: white noise would not."""
    frequency, density = welch(signal, rate, nperseg=min(_WELCH, len(signal)), axis=0)
    low, high = max(stop, rate / 8), rate / 2
    middle = np.sqrt(low * high)
    lower, upper = (frequency >= low) & (frequency < middle), (frequency >= middle) & (frequency < high)
    if not (lower.any() and upper.any()):
        return np.zeros(signal.shape[1:], dtype=bool)
    first, last = np.median(density[lower], axis=0), np.median(density[upper], axis=0)
    return np.asarray(first > last * np.sqrt(high / low) ** limits.steepest_fall)
