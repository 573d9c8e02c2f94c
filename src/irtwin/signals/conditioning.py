"""From a run as logged to a motion: even sampling, zero-phase filter, derivatives."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import scipy

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import REQUIRED
from irtwin.signals.filter import FEWEST_PERIODS, low_pass
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion
from irtwin.signals.samples import FEWEST
from irtwin.signals.sampling import earlier, holes, interpolated, interval

_BAND_SHARE = 0.99  # of the speed's power lies below the band of the motion
_BAND_FACTOR = 10.0  # Gautier 1997 asks for at least five times the band of the motion
_ABOVE_NOISE = 3.0  # times the mean noise: what stands out is motion
_SMOOTHED = 4.0  # times: white noise has as much in the upper half of the highest octave as in all of it
_NYQUIST_SHARE = 0.8  # of the Nyquist frequency: the highest cutoff that is chosen
_STATES = ("q", "dq", "ddq")
_STATES_WIDER = 3.0  # what is below the cutoff then passes unchanged
_AGREEMENT = 0.1  # logged speeds are taken where they differ by less than this from those of the positions
_SAME = 1e-9  # rad or m: positions that differ by less are one
_NEXT = 5.5  # steps of an encoder: positions that are closer show its grid
STANDSTILL = 1e-3  # rad/s: below, the sign of a speed is that of its noise


def condition(
    run: Run,
    robot: Robot,
    cutoff: float | None = None,
    time: np.ndarray | None = None,
    *,
    states_cutoff: float | np.ndarray | None = None,
) -> Motion:
    """Return the run's signals at an even rate (the sampling's), low-pass filtered without phase shift.

    Speeds and accelerations are derivatives of the filtered positions; speeds that were logged are taken instead
    where they agree with these. `cutoff` in Hz; None chooses it by `choose_cutoff`; `states_cutoff` is another one for
    positions, speeds and accelerations, of all joints or of each, (n,). `time`: even times, (N,) s within the run, to
    be returned instead of all of it. Raises InputError on a cutoff that is no positive number, or on a run of fewer
    than 20 samples or, unless `time` is given, with a hole in time.
    """
    signals = run.signals
    if len(signals.time) < FEWEST:
        raise InputError(f"{run.file}: has {len(signals.time)} samples; a run needs at least {FEWEST}")
    if cutoff is None:
        cutoff = choose_cutoff([run])
    if not (np.isfinite(cutoff) and cutoff > 0):
        raise InputError(f"a cutoff of {cutoff:g} Hz filters everything away; give a positive frequency")
    time = _even_time(run) if time is None else time
    rate = 1 / (time[1] - time[0])

    def clean(values: np.ndarray, cutoff: float | np.ndarray, order: int = 1) -> np.ndarray:
        even = scipy.interpolate.make_interp_spline(signals.time, values, k=order)(time)
        if isinstance(cutoff, float):
            return low_pass(even, rate, cutoff)
        return np.column_stack([low_pass(column, rate, own) for column, own in zip(even.T, cutoff, strict=True)])

    cutoffs = dict.fromkeys(_STATES, float(cutoff) if states_cutoff is None else states_cutoff)
    logged = {name: values for name, values in signals.logged().items() if name not in REQUIRED}
    measured: dict[str, Any] = {
        name: clean(values, cutoffs.get(name, float(cutoff))) for name, values in logged.items()
    }
    q = clean(signals.q, cutoffs["q"], order=3)
    dq = _agreeing(measured.pop("dq", None), differentiate(q, rate), time)
    ddq = _agreeing(measured.pop("ddq", None), differentiate(dq, rate), time)
    if states_cutoff is not None and signals.torque is not None:
        measured["fast_torque"] = clean(signals.torque, states_cutoff) - measured["torque"]
    return Motion(
        time,
        q,
        dq,
        ddq,
        run=run.name,
        standing=_standing(interpolated(signals.time, signals.q, time), signals.q, rate),
        payload_mass=run.payload_mass,
        payload_com=run.payload_com,
        cutoff=cutoff,
        **measured,
    )


def condition_for_fit(run: Run, robot: Robot, cutoff: float) -> Motion:
    """Return the run's signals as `condition` does, its states filtered more widely.

    What a fit computes of states passes the filter of the measurement, as the measurement does; states that had passed
    it before would pass it twice, and what they lose there looks like an elastic joint.
    """
    return condition(run, robot, cutoff, states_cutoff=states_cutoff(run, cutoff))


def states_cutoff(run: Run, cutoff: float) -> np.ndarray:
    """Return the cutoff (n,), Hz, of each joint's states for a fit: wider than `cutoff`, if its encoder resolves that.

    By noise of the encoder's steps a joint that hardly moves would seem to turn back and forth, so its speed has to
    stand out from it: that is where it agrees, or is standstill. Positions between two steps are off by white noise of
    a twelfth of the step's square; of its derivative (2 pi)^2 2 f^3 / (3 rate) times as much is below a frequency f.
    """
    time = _even_time(run)
    rate = 1 / (time[1] - time[0])
    speed = rate * np.diff(low_pass(interpolated(run.signals.time, run.signals.q, time), rate, cutoff), axis=0)
    least = np.maximum(_AGREEMENT * np.sqrt(np.mean(speed**2, axis=0)), STANDSTILL)
    steps = np.array([max(encoder_step(positions), _SAME) for positions in run.signals.q.T])
    resolved = np.cbrt(18 * rate * (least / (2 * np.pi * steps)) ** 2)
    return np.asarray(np.clip(resolved, cutoff, _STATES_WIDER * cutoff))


def choose_cutoff(runs: Iterable[Run]) -> float:
    """Return the cutoff (Hz) for runs that are to be treated alike.

    The band of a motion ends where 99 % of the power of its speeds lies below; white noise of the positions, as
    seen in the highest octave, is taken off first. The cutoff is ten times that (M. Gautier, "Dynamic
    identification of robots with power model", ICRA 1997, asks for at least five), so that the filter leaves the
    motion and its accelerations as they are and takes away the noise above; at most 0.8 of the Nyquist frequency.
    All runs count together: in slow ones steps of the encoder look like motion of a wide band.
    """
    return cutoff_of_motion(runs)[0]


def cutoff_of_motion(runs: Iterable[Run]) -> tuple[float, str]:
    """Return the cutoff (Hz) as `choose_cutoff` does, and what decided it, in words."""
    every = list(runs)
    frequency, power = map(np.concatenate, zip(*(_speed_spectrum(run) for run in every), strict=True))
    order = np.argsort(frequency, kind="stable")
    share = np.cumsum(power[order]) / max(power.sum(), np.finfo(float).tiny)
    band = frequency[order][min(int(np.searchsorted(share, _BAND_SHARE)), len(order) - 1)]
    shortest = min(float(run.signals.time[-1] - run.signals.time[0]) for run in every)
    wanted = float(max(_BAND_FACTOR * band, FEWEST_PERIODS / shortest))
    highest = max(_NYQUIST_SHARE / interval(run.signals.time) / 2 for run in every)
    of_motion = wanted, f"{_BAND_FACTOR:g} times the bandwidth of the motion"
    return min(of_motion, (highest, f"{_NYQUIST_SHARE:g} of the Nyquist frequency"))


def differentiate(signal: np.ndarray, rate: float) -> np.ndarray:
    """Return the time derivative of an even (N, ...) signal through the quintic spline that interpolates it."""
    time = np.arange(len(signal)) / rate
    return np.asarray(scipy.interpolate.make_interp_spline(time, signal, k=5).derivative()(time))


def _standing(q: np.ndarray, logged: np.ndarray, rate: float) -> np.ndarray:
    """Return where unfiltered positions (N, n) do not move: a filter would lend them their surroundings' speed.

    They are watched for as long as a joint at `STANDSTILL` takes for a step of its encoder, by the positions (M, n) as
    `logged`: between two steps, slow motion looks like rest.
    """
    standing = np.zeros(q.shape, dtype=bool)
    for joint, positions in enumerate(q.T):
        half = round(encoder_step(logged[:, joint]) / STANDSTILL * rate / 2) + 1
        lowest, highest = (
            extreme(positions, 2 * half + 1, mode="nearest")
            for extreme in (scipy.ndimage.minimum_filter1d, scipy.ndimage.maximum_filter1d)
        )
        standing[:, joint] = highest - lowest < STANDSTILL * 2 * half / rate
    return standing


def encoder_step(positions: np.ndarray) -> float:
    """Return by how much two positions (N,) differ that are not the same, at least; 0 where all are the same.

    So it is where they lie on no grid of such steps: a joint that only ever moves fast does not show its encoder.
    """
    steps = np.diff(np.unique(positions))
    if not len(steps := steps[steps > _SAME]):
        return 0.0
    least = float(steps.min())
    near = steps[steps < _NEXT * least] / least
    return least if np.mean(np.abs(near - np.round(near)) < 0.1) > 0.9 else 0.0


def _even_time(run: Run) -> np.ndarray:
    time = run.signals.time
    if len(holes(time)):
        raise InputError(
            f"{run.file}: has a hole in time after {time[holes(time)[0] - 1]:.12g} s; split it into two runs"
        )
    return np.linspace(time[0], time[-1], round((time[-1] - time[0]) / interval(time)) + 1)


def _speed_spectrum(run: Run) -> tuple[np.ndarray, np.ndarray]:
    """Return frequencies (F,), Hz, and the squares of all joints' speeds at each, times the run's time, less noise."""
    even = _even_time(run)
    rate = 1 / (even[1] - even[0])
    speed = rate * np.diff(interpolated(run.signals.time, run.signals.q, even), axis=0)
    power = np.abs(np.fft.rfft(speed * np.hanning(len(speed))[:, None], axis=0)) ** 2 / len(speed)
    frequency = np.fft.rfftfreq(len(speed), 1 / rate)
    gain = np.sin(np.pi * frequency / rate)[:, None] ** 2  # white positions, differenced
    octave = frequency > rate / 4
    noise = _of_exponential(power[octave] / gain[octave])
    return frequency, np.maximum(power - _ABOVE_NOISE * noise * gain, 0.0).sum(axis=1) / rate


def white_noise(time: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the standard deviation (n,) of the white noise of values (N, n), as seen in the highest octave.

    NaN where that falls as of values that were smoothed before they were logged.
    """
    rate, window = 1 / interval(time), np.hanning(len(values))[:, None]
    power = np.abs(np.fft.rfft(window * (values - values.mean(axis=0)), axis=0)) ** 2 / np.sum(window**2)
    frequency = np.fft.rfftfreq(len(values), 1 / rate)
    whole, upper = (_of_exponential(power[frequency > share * rate]) for share in (0.25, 0.375))
    return np.where(whole > _SMOOTHED * upper, np.nan, np.sqrt(whole))


def _of_exponential(power: np.ndarray) -> np.ndarray:
    """Return the mean (n,) of what is exponential, (F, n), from its median: lines of a spectrum do not move that."""
    return np.asarray(np.median(power, axis=0) / np.log(2))


def _agreeing(logged: np.ndarray | None, derived: np.ndarray, time: np.ndarray) -> np.ndarray:
    """Return what was logged where it agrees, over all joints, with what the positions say; else the latter.

    Robots log speeds that a filter has made late: they are taken as much earlier.
    """
    if logged is None:
        return derived
    aligned = earlier(time, logged, lag_of(logged, derived, 1 / (time[1] - time[0])))
    best = min(aligned, logged, key=lambda candidate: np.mean((candidate - derived) ** 2))
    return best if np.mean((best - derived) ** 2) <= _AGREEMENT**2 * np.mean(derived**2) else derived


def lag_of(logged: np.ndarray, derived: np.ndarray, rate: float) -> float:
    """Return by how much signals (N, n) come later than others, s; small beside the time in which these change.

    Their difference is the lag times the slope of these. That of the logged ones is the instrument: noise of positions
    is in both others.
    """
    slope, instrument = (differentiate(signal, rate) for signal in (derived, logged))
    weights = 1 / np.maximum(np.mean(instrument**2, axis=0), np.finfo(float).tiny)
    across, along = (np.sum(weights * np.mean(values * instrument, axis=0)) for values in (derived - logged, slope))
    return float(across / along) if along > 0 else 0.0
