"""The noise floor: what no model of the motion could explain."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from irtwin.gap.data.differences import Pair, pairs_of
from irtwin.gap.thresholds import Data
from irtwin.robot.description import Robot
from irtwin.signals.conditioning import condition, encoder_step, states_cutoff
from irtwin.signals.filter import kernel, low_pass
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import interpolated

REPEATS, OUT_OF_BAND = "repeats", "out_of_band"
_LEAST = 1e-9  # N m or W: of a channel that repeats itself to the last bit
_MOST_BAND = 0.9  # of all frequencies in the band: with more of them nothing is left to tell noise from
_WELCH = 512  # samples of a stretch whose spectrum is averaged
_ENOUGH = 20_000  # samples: its products are then known within some percent


@dataclass(frozen=True)
class Floor:
    """RMS of the noise in the filter's band: torque (n,) N m, power W; None where it was not measured or unknown.

    `source` is "repeats", "out_of_band", or None where neither could tell. `sensor_torque`, `sensor_power`: the part of
    it that is the sensors' noise; from repeats, the rest differs between runs.
    """

    torque: np.ndarray | None
    power: float | None
    source: str | None
    sensor_torque: np.ndarray | None = None
    sensor_power: float | None = None


def noise_floor(runs: Sequence[Run], motions: Mapping[str, Motion], limits: Data) -> Floor:
    """Return the floor: from repeats of one motion where there are any, else from above the band.

    A simulator's runs say nothing of it: they have no noise, and repeat themselves.
    `motions`: each run's, by name, filtered alike. Repeats: RMS of the aligned difference / sqrt(2), pooled.
    Above the band: what the filter took away, taken as white, scaled to the band. This misses noise that is
    coloured, so it is the smaller of the two. A run that was smoothed before it was logged tells nothing.
    """
    runs = [run for run in runs if run.role != "simulated"]
    pairs = pairs_of(runs, motions, limits)
    torque = _pooled([_repeated(pair, "torque") for pair in pairs])
    power = _pooled([_repeated(pair, "power") for pair in pairs])
    sensors, meter = sensor_noise(runs, motions, limits)
    source = REPEATS
    if torque is None and power is None:
        torque, power, source = sensors, meter, OUT_OF_BAND
    if torque is None and power is None:
        return Floor(None, None, None)
    return Floor(torque, _one(power), source, sensors, _one(meter))


def _one(level: np.ndarray | None) -> float | None:
    return None if level is None else float(level[0])


def sensor_noise(
    runs: Sequence[Run], motions: Mapping[str, Motion], limits: Data
) -> tuple[np.ndarray | None, np.ndarray | None]:
    """Return the RMS in the band of what the sensors' noise has above it, taken as white: torque (n,), power (1,)."""
    torque = _pooled([_above(run.signals.time, run.signals.torque, motions[run.name], limits) for run in runs])
    power = _pooled([_above(run.signals.time, run.signals.power, motions[run.name], limits) for run in runs])
    return torque, power


def _pooled(variances: Sequence[np.ndarray | None]) -> np.ndarray | None:
    """Return the RMS of all runs (n,), None where some joint's is known of none."""
    known = np.array([variance for variance in variances if variance is not None])
    if not len(known) or np.isnan(known).all(axis=0).any():
        return None
    return np.asarray(np.maximum(np.sqrt(np.nanmean(known, axis=0)), _LEAST))


def _repeated(pair: Pair, signal: str) -> np.ndarray | None:
    """Return half the mean square difference of two runs of one motion, (n,) or (1,).

    Of torque where the joint moves, as what a fit leaves is judged there; of a joint at rest throughout, at rest.
    """
    difference = pair.difference(signal)
    if difference is None:
        return None
    squares = _without_jumps(difference**2 / 2)
    if signal != "torque":
        return np.atleast_1d(np.mean(squares, axis=0))
    moving = pair.moving
    judged = moving | ~moving.any(axis=0)
    return np.asarray(np.mean(squares, axis=0, where=judged))


def _without_jumps(squares: np.ndarray) -> np.ndarray:
    """Cap the one percent largest: repeats change the sign of friction at slightly different instants."""
    return np.asarray(np.minimum(squares, np.quantile(squares, 0.99, axis=0)))


def _above(time: np.ndarray, signal: np.ndarray | None, motion: Motion, limits: Data) -> np.ndarray | None:
    """Return the variance in the band of white noise that has what the filter takes away above it; NaN if smoothed."""
    variance = white_noise(time, signal, motion, limits)
    return None if variance is None else variance * _share(motion)


def white_noise(
    time: np.ndarray, signal: np.ndarray | None, motion: Motion, limits: Data, shows: np.ndarray | None = None
) -> np.ndarray | None:
    """Return the variance of white noise that has above the band what the filter takes away; NaN if smoothed.

    The lesser of two medians: that over time, which no jump of friction moves, and that over frequency, which no line
    of the spectrum does. None where nothing is known of it. `shows`, as the signal: where the noise is there at all.
    """
    share = _share(motion)
    if signal is None or motion.cutoff is None or share > _MOST_BAND:
        return None
    even = interpolated(time, signal, motion.time)
    above = even - low_pass(even, motion.rate, motion.cutoff)
    noisy = np.ones(even.shape, dtype=bool) if shows is None else interpolated(time, shows, motion.time) > 0.5
    over_time = _median(above**2, noisy) / 0.4549 / (1 - share)
    window = np.hanning(len(even)).reshape(-1, *(1,) * (even.ndim - 1))
    power = np.abs(np.fft.rfft(window * (even - even.mean(axis=0)), axis=0)) ** 2 / (window**2).sum()
    over_frequency = np.median(power[np.linspace(0.0, 1.0, len(power)) > share], axis=0) / np.log(2)
    over_frequency /= np.maximum(noisy.mean(axis=0), 1 / len(even))
    variance = np.minimum(over_time, over_frequency)
    return np.atleast_1d(np.where(_smoothed(even, motion.rate, share * motion.rate / 2, limits), np.nan, variance))


def _median(values: np.ndarray, shown: np.ndarray) -> np.ndarray:
    """Return the median over time of the values that are shown, 0 where none is."""
    some = shown.any(axis=0)
    return np.asarray(np.nan_to_num(np.nanmedian(np.where(shown | ~some, values, np.nan), axis=0)) * some)


def _share(motion: Motion) -> float:
    """Return the part of all frequencies that is in the filter's band."""
    if motion.cutoff is None or len(kernel(motion.rate, motion.cutoff)) == 1:
        return 1.0
    return min(1.0, motion.cutoff / (motion.rate / 2))


def _smoothed(signal: np.ndarray, rate: float, stop: float, limits: Data) -> np.ndarray:
    """Return whether the spectrum of a signal, from `stop` (Hz) on, falls up to its very end: white noise would not."""
    frequency, density = _density(signal, rate)
    low, high = max(stop, rate / 8), rate / 2
    middle = np.sqrt(low * high)
    lower, upper = (frequency >= low) & (frequency < middle), (frequency >= middle) & (frequency < high)
    if not (lower.any() and upper.any()):
        return np.zeros(signal.shape[1:], dtype=bool)
    first, last = np.median(density[lower], axis=0), np.median(density[upper], axis=0)
    return np.asarray(first > last * np.sqrt(high / low) ** limits.smoothed)


def _density(signal: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Return Welch's estimate of a signal's spectrum (F, ...), up to a factor, and its frequencies (F,), Hz."""
    length = min(_WELCH, len(signal))
    pieces = np.lib.stride_tricks.sliding_window_view(signal, length, axis=0)[:: length - length // 2]
    window = np.hanning(length + 1)[:-1]
    powers = np.abs(np.fft.rfft(window * (pieces - pieces.mean(axis=-1, keepdims=True)))) ** 2
    return np.fft.rfftfreq(length, 1 / rate), np.moveaxis(powers.mean(axis=0), -1, 0)


def shaken(
    runs: Sequence[Run], motions: Mapping[str, Motion], robot: Robot, limits: Data
) -> tuple[tuple[Motion, Motion], ...]:
    """Return observed runs' motions, each with the same of positions and speeds to which their noise was added again.

    The noise is white, as large as what the filter takes away says; runs that were smoothed before they were logged
    tell none. So many runs as make `_ENOUGH` samples, if there are; the middle of one that has more.
    """
    random = np.random.default_rng(0)
    pairs: list[tuple[Motion, Motion]] = []
    missing = _ENOUGH
    for run in (run for run in runs if run.role == "observed"):
        motion = motions[run.name]
        again = _shaken(run, motion, robot, limits, random)
        if again is not None:
            pairs.append((_middle(motion, missing), _middle(again, missing)))
            missing -= len(motion.time)
        if missing <= 0:
            break
    return tuple(pairs)


def _middle(motion: Motion, samples: int) -> Motion:
    """Return so many samples of the middle of a motion, as a motion; all of one that has no more."""
    first = (len(motion.time) - samples) // 2
    return motion if first <= 0 else motion.rows(slice(first, first + samples))


def _shaken(run: Run, motion: Motion, robot: Robot, limits: Data, random: np.random.Generator) -> Motion | None:
    if motion.cutoff is None:
        return None
    noisy = {}
    states = {name: getattr(run.signals, name) for name in ("q", "dq", "ddq")}
    for name, signal in states.items():
        if signal is None:
            continue
        shows = _varies(signal, motion.rate, motion.cutoff)
        variance = white_noise(run.signals.time, signal, motion, limits, shows)
        if variance is not None and name == "q":  # at a steady speed rounding makes lines, which no median shows
            variance = np.fmax(variance, np.square([encoder_step(own) for own in signal.T]) / 12)
        if variance is not None and np.nansum(variance) > 0:
            noisy[name] = signal + random.standard_normal(signal.shape) * np.sqrt(np.nan_to_num(variance)) * shows
    if not noisy:
        return None
    cutoffs = states_cutoff(run, motion.cutoff)  # shaken positions lie on no grid, and tell nothing of the encoder
    signals = replace(run.signals, **noisy)
    again = condition(replace(run, signals=signals), robot, motion.cutoff, states_cutoff=cutoffs)
    return replace(motion, q=again.q, dq=again.dq, ddq=again.ddq)


def _varies(signal: np.ndarray, rate: float, cutoff: float) -> np.ndarray:
    """Return 1 where a signal varies within the filter's reach, else 0: rounding of what stands still is no noise."""
    changes = np.diff(signal, axis=0, prepend=signal[:1]) != 0
    return np.asarray(scipy.ndimage.maximum_filter1d(changes.astype(float), len(kernel(rate, cutoff)), axis=0))
