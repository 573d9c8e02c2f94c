"""What a meter's log says by itself, of a supply whose joints nobody logged: its states, cycles and energy by hour."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

from irtwin.signals.channels import Samples
from irtwin.signals.motion import stretches

OFF, STANDBY, WORKING = "off", "standby", "working"
_OFF = 0.02  # of what is drawn at work: less is off
_APART = 0.75  # of the spread of power that two levels must explain, to be two
_STEADY = 0.15  # of the step between both levels: what power at standby may spread
_SHORTEST = 2.0, 3  # s, and samples: a shorter low is a part of work
_FEWEST = 3  # cycles that tell of any
_ALIKE = 0.2  # of the median: what the periods and energies of cycles may differ by
_REPEATS = 0.5  # correlation of power with itself a cycle later


@dataclass(frozen=True)
class LoadState:
    """A state of the supply: how long it lasted in all, s, and its mean power, W."""

    name: str
    seconds: float
    power: float


@dataclass(frozen=True)
class Cycles:
    """Stretches of work that repeat: how many, and of the median one the period, s, and the energy, J."""

    count: int
    seconds: float
    energy: float


@dataclass(frozen=True)
class LoadProfile:
    """A run by its power; `standby`: W, None where no lower level was found; `standing`: (N,) at standby or off."""

    energy: float  # J
    states: tuple[LoadState, ...]
    standby: float | None
    cycles: Cycles | None
    standing: np.ndarray


def load_profile(time: Samples, power: Samples) -> LoadProfile:
    """Return what power (N,) in W at times (N,) in s says.

    Work and standby are two levels of power, told apart where they explain three quarters of its spread and the lower
    one is steady; a change of level is one that lasts. Cycles are stretches of work from one change to the next that
    take alike, else what repeats within the longest stretch.
    """
    levels = _levels(time, power)
    spent = scipy.integrate.cumulative_trapezoid(power, time, initial=0.0)
    share = np.gradient(time)  # s that each sample stands for
    share *= (time[-1] - time[0]) / share.sum()
    states = tuple(
        LoadState(name, float(share[mask].sum()), float(np.average(power[mask], weights=share[mask])))
        for number, name in enumerate((OFF, STANDBY, WORKING))
        if (mask := levels == number).any()
    )
    standby = next((state.power for state in states if state.name == STANDBY), None)
    return LoadProfile(float(spent[-1]), states, standby, _cycles(time, power, spent, levels == 2), levels < 2)


def by_hour(time: Samples, power: Samples, into: float) -> list[float]:
    """Return the energy (J) of each hour of the clock that a run touches; it began `into` s after an hour began."""
    spent = scipy.integrate.cumulative_trapezoid(power, time, initial=0.0)
    since = time - time[0] + into
    ends = np.arange(0.0, since[-1] + 3600.0, 3600.0)
    return [float(joules) for joules in np.diff(np.interp(ends, since, spent))]


def _levels(time: Samples, power: Samples) -> np.ndarray:
    """Return 0, 1 or 2 for each sample: off, standby, working."""
    on = power > _OFF * np.quantile(power, 0.95)
    levels = np.where(on, 2, 0)
    limit = _between(power[on]) if on.any() else None
    if limit is not None:
        levels[on & (power < limit)] = 1
    least = max(_SHORTEST[0], _SHORTEST[1] * float(np.median(np.diff(time))))
    for own in stretches(levels < 2):
        if time[min(own.stop, len(time) - 1)] - time[own.start] < least:
            levels[own] = 2
    low, high = power[levels == 1], power[levels == 2]
    if len(low) and len(high) and low.std() > _STEADY * (high.mean() - low.mean()):
        levels[levels == 1] = 2
    return levels


def _between(power: Samples) -> float | None:
    """Return the power that parts two levels best (Otsu), None where two explain too little."""
    ordered = np.sort(power)
    spread = float(((ordered - ordered.mean()) ** 2).sum())
    count = np.arange(1, len(ordered))
    total = np.cumsum(ordered)
    low, high = total[:-1] / count, (total[-1] - total[:-1]) / (len(ordered) - count)
    apart = count * (len(ordered) - count) / len(ordered) * (high - low) ** 2
    if len(apart) == 0 or apart.max() < _APART * spread or spread == 0.0:
        return None
    best = int(np.argmax(apart))
    return float(ordered[best] + ordered[best + 1]) / 2


def _cycles(time: Samples, power: Samples, spent: Samples, working: np.ndarray) -> Cycles | None:
    at_work = list(stretches(working))
    starts = np.array([own.start for own in at_work if own.start > 0])
    if len(starts) > _FEWEST:
        periods, energies = np.diff(time[starts]), np.diff(spent[starts])
        if _alike(periods) and _alike(energies):
            return Cycles(len(periods), float(np.median(periods)), float(np.median(energies)))
    longest = max(at_work, key=lambda own: own.stop - own.start, default=slice(0, 0))
    return _repeating(time[longest], power[longest], spent[longest])


def _alike(values: np.ndarray) -> bool:
    middle = float(np.median(values))
    return bool(np.quantile(np.abs(values - middle), 0.75) <= _ALIKE * middle)


def _repeating(time: Samples, power: Samples, spent: Samples) -> Cycles | None:
    """Return what repeats in a stretch of work: the first peak of its power's correlation with itself."""
    count = len(time)
    if count < 4 * _FEWEST:
        return None
    even = np.linspace(time[0], time[-1], count)
    size = 1 << (2 * count - 1).bit_length()
    centred = np.interp(even, time, power)
    centred -= centred.mean()
    correlation = np.fft.irfft(np.abs(np.fft.rfft(centred, size)) ** 2)[: count // _FEWEST + 1]
    if correlation[0] <= 0:
        return None
    same = correlation / correlation[0] * count / (count - np.arange(len(correlation)))
    below = np.flatnonzero(same < 0)
    if len(below) == 0:
        return None
    peak = below[0] + int(np.argmax(same[below[0] :]))
    near = np.flatnonzero(same[below[0] :] > 0.9 * same[peak]) + below[0]  # the first as high, not its multiple
    first = int(near[0])
    while first + 1 < len(same) and same[first + 1] > same[first]:
        first += 1
    if same[first] < _REPEATS:
        return None
    seconds = first * float(even[1] - even[0])
    lasts = float(time[-1] - time[0])
    return Cycles(int(lasts / seconds), seconds, float(spent[-1] - spent[0]) * seconds / lasts)
