"""Switching: a load that goes on and off beside the robot, told by steps of power that two runs do not share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.signal import find_peaks

from irtwin.gap.regression.correlation import correlation_samples
from irtwin.gap.repeats.series import Series
from irtwin.gap.thresholds import NotRepeating

_WIDTHS = (0.1, 0.25, 0.6)  # s on either side of a step, over which power is averaged
_FEWEST = 4  # samples of that
_LOUD = 0.8  # quantile of the steps that is one of the load, and not of what joints do between
_HIGHER = (1.0, 1.4)  # times the steps' height: a first guess is low where steps are short
_SIDES = (-1, 1)  # steps alone do not say which run had the load before the first: the second, the first
_ENOUGH = 10  # samples for each column that the motion may take
_ROUNDS = 10  # of fitting what the motion takes and what is on, in turn
_SPREAD = 1.4826  # standard deviation of what is normal, over its median deviation
_BIN = 0.02  # s, over which power is averaged before it is said when a load is on,
_MOST_BINS = 20_000  # or longer, in long runs
_SWITCH = 8.0  # what a switch costs in the logarithm of the likelihood: one in a few thousand bins
_LEAST = 0.05  # of the load: bins are known no better
_BOTH = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])  # whether it is on in either run

Edges = list[tuple[float, float]]
"""Times, s, and steps, W."""


@dataclass(frozen=True)
class Watched:
    """The difference of the power of two runs, `names`, on the first's clock, which is `shift` s ahead."""

    names: tuple[str, str]
    shift: float
    difference: Series


@dataclass(frozen=True)
class Switching:
    """A load of `level` W with its `deviation`, on where `states` (N,) of each run say one, zero elsewhere.

    `edges`: the times of each run, s, at which it goes on (+) or off (-); `explained`: its part of what differs.
    """

    level: float
    deviation: float
    states: Mapping[str, np.ndarray]
    edges: Mapping[str, Edges]
    explained: float

    @property
    def duty(self) -> float:
        """The share of time that it is on."""
        return float(np.mean(np.concatenate(list(self.states.values()))))

    @property
    def periods(self) -> list[float]:
        """The times from one switching on to the next, s."""
        on = [[time for time, step in each if step > 0] for each in self.edges.values()]
        return [float(value) for times in on for value in np.diff(times)]


def switching(pairs: Sequence[Watched], runs: Mapping[str, Series], limits: NotRepeating) -> Switching | None:
    """Return the load that switches; None where steps do not explain what differs.

    `runs`: each run's power by name, with columns beside it that the motion may take.
    """
    differences, found = [pair.difference for pair in pairs], []
    for width in _WIDTHS:
        steps = [_steps(one, width, limits) for one in differences]
        level = _height(steps, limits)
        if level is not None:
            plain = [_beside(one, []) for one in differences]
            found += [_followed(pairs, runs, level * more, plain, limits) for more in _HIGHER]
            for side in _SIDES:
                begun = [_beside_steps(*each, level, side) for each in zip(differences, steps, strict=True)]
                found.append(_followed(pairs, runs, level, begun, limits, by_steps=True))
    return max((one for one in found if one is not None), key=lambda one: one.explained, default=None)


def _height(each: Sequence[Edges], limits: NotRepeating) -> float | None:
    """Return how high most steps are that stand out, W; None where they are of any height."""
    heights = np.abs([step for steps in each for _, step in steps])
    heights = heights[heights > np.quantile(heights, _LOUD) / 2] if len(heights) else heights  # not the robot's own
    if len(heights) < 2:
        return None
    level = float(np.median(heights))
    off = np.minimum(
        np.abs(heights - level), np.abs(heights - 2 * level)
    )  # twice: on in one as it goes off in the other
    return level if np.mean(off <= limits.alike * level) >= limits.fewest_alike else None


def _followed(
    pairs: Sequence[Watched],
    runs: Mapping[str, Series],
    level: float,
    differ: Sequence[np.ndarray],
    limits: NotRepeating,
    by_steps: bool = False,
) -> Switching | None:
    """Return the load found from a first guess of its level, W: when it is on, and how high it is, in turn.

    `differ`: a first guess of what each pair of runs differs by without what follows the motion. `by_steps`: it is a
    good one, and the first course goes by it alone; what each run's motion takes is then told from where the runs
    differ, as there one has the load and the other not.
    """
    states = {name: np.zeros(len(runs[name].time)) for pair in pairs for name in pair.names}
    deviation, first, known = 0.0, by_steps, None
    for _ in range(_ROUNDS):
        left, before = None if first else _left(runs, states, level, known), level
        for pair, values in zip(reversed(pairs), reversed(differ), strict=True):
            states |= _on(pair, runs, left, values, level)
        known, first = _where_apart(pairs, states, runs) if first else None, False
        level, deviation = _level(pairs, states, runs)
        if level <= 0:
            return None
        if known is None and abs(level - before) < _LEAST / 10 * level:
            break
        differ = [_beside(pair.difference, [_apart(pair, states, runs)]) for pair in pairs]
    explained = _explained(pairs, states, runs)
    edges = {name: _edges(runs[name].time, state) for name, state in states.items()}
    if explained < limits.switching or sum(map(len, edges.values())) < 2:
        return None
    return Switching(level, deviation, states, edges, explained)


def _steps(series: Series, width: float, limits: NotRepeating) -> Edges:
    """Return the steps of a difference that stand out; what it follows is fitted between them, anew."""
    size = max(_FEWEST, round(width * series.rate))
    if len(series.values) < 4 * size:
        return []
    spread = _white(series) * np.sqrt(2 / size)
    found: Edges = []
    for _ in range(_ROUNDS):
        step = _step(_beside(series, _stairs(series, found)), size)
        places, _ = find_peaks(np.abs(step), height=max(limits.step * spread, 1e-12), distance=size)
        found = [(float(series.time[k + size]), float(step[k])) for k in places]
    return found


def _stairs(series: Series, edges: Edges) -> list[np.ndarray]:
    """Return a column (N,) of each step: zero before it, one from it on."""
    return [(series.time >= time).astype(float) for time, _ in edges]


def _beside(series: Series, load: Sequence[np.ndarray]) -> np.ndarray:
    """Return the values (N,) without what follows the motion, which is fitted beside the columns of a load."""
    motion = series.with_columns(*load).coefficients()[: series.beside.shape[1]]
    return np.asarray(series.values - series.beside @ motion)


def _beside_steps(series: Series, edges: Edges, level: float, side: int) -> np.ndarray:
    """Return what differs (N,) beside steps, which take none of the load for the motion.

    It is shifted to lie within one load either way; where there is room, to one `side`.
    """
    way = np.cumsum([0.0, *(step for _, step in edges)]) / level
    start = round(float(1 - way.max() if side > 0 else -1 - way.min()))
    return _beside(series, _stairs(series, edges)) + level * start


def _step(values: np.ndarray, size: int) -> np.ndarray:
    """Return the mean of `size` samples from each on, less that of those before, (N - 2 size + 1,)."""
    sums = np.concatenate([[0.0], np.cumsum(values)])
    means = (sums[size:] - sums[:-size]) / size
    return np.asarray(means[size:] - means[:-size])


def _on(
    pair: Watched,
    runs: Mapping[str, Series],
    left: Mapping[str, np.ndarray] | None,
    differ: np.ndarray,
    level: float,
) -> dict[str, np.ndarray]:
    """Return when the load is on in the runs of a pair, by its likeliest course (Viterbi's).

    What they `differ` by says that one has it and not the other; their sum, of what is `left` of each, whether both do.
    """
    first, second = pair.names
    one, two = runs[first], runs[second]
    said = [(differ, _BOTH[:, 0] - _BOTH[:, 1])]
    if left is not None:
        own = np.interp(pair.difference.time, one.time, left[first])
        other = np.interp(pair.difference.time - pair.shift, two.time, left[second])
        said.append((own + other, _BOTH.sum(axis=1)))
    size = max(1, round(_BIN * one.rate), -(-len(differ) // _MOST_BINS))
    count = len(differ) // size
    if count < 2:
        return {}
    pays = np.zeros((count, len(_BOTH)))
    for each, expected in said:
        values = np.mean(each[: count * size].reshape(count, size), axis=1)
        off = (values[:, None] - level * expected) ** 2
        best = np.sqrt(off.min(axis=1))
        variance = float(np.mean(best**2)) * correlation_samples(values - level * expected[off.argmin(axis=1)])
        pays -= off / (2 * max(variance, (_LEAST * level) ** 2))
    course = _likeliest(pays)
    time = pair.difference.time[: count * size : size]
    found = {}
    for k, (name, at) in enumerate(((first, one.time), (second, two.time + pair.shift))):
        place = np.clip(np.searchsorted(time, at, side="right") - 1, 0, count - 1)
        found[name] = _BOTH[course, k][place]
    return found


def _likeliest(pays: np.ndarray) -> np.ndarray:
    """Return the likeliest course (T,) through states of log-likelihood (T, S); each switch costs."""
    costs = _SWITCH * np.abs(_BOTH[:, None] - _BOTH[None]).sum(axis=2)
    best, came = pays[0], np.zeros(pays.shape, dtype=int)
    for k in range(1, len(pays)):
        ways = best[:, None] - costs
        came[k] = ways.argmax(axis=0)
        best = ways.max(axis=0) + pays[k]
    course = [int(best.argmax())]
    for k in range(len(pays) - 1, 0, -1):
        course.append(int(came[k, course[-1]]))
    return np.array(course[::-1])


def _edges(time: np.ndarray, state: np.ndarray) -> Edges:
    return [(float(time[k + 1]), float(state[k + 1] - state[k])) for k in np.flatnonzero(np.diff(state))]


def _stacked(runs: Mapping[str, Series], states: Mapping[str, np.ndarray]) -> Series:
    """Return all runs one after the other, with what is on as the last column."""
    parts = [runs[name].with_columns(state) for name, state in states.items()]
    return Series(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("time", "values", "beside")))


def _where_apart(
    pairs: Sequence[Watched], states: Mapping[str, np.ndarray], runs: Mapping[str, Series]
) -> np.ndarray | None:
    """Return where each run's load is known, as its partner's is another, one run after the other; None: too little."""
    known = {name: np.zeros(len(state), dtype=bool) for name, state in states.items()}
    for pair in pairs:
        differ = np.abs(_apart(pair, states, runs))
        for name, shift in zip(pair.names, (0.0, pair.shift), strict=True):
            known[name] |= np.interp(runs[name].time, pair.difference.time - shift, differ) > 0.5
    stacked = np.concatenate(list(known.values()))
    columns = next(iter(runs.values())).beside.shape[1]
    return stacked if stacked.sum() > _ENOUGH * columns else None


def _left(
    runs: Mapping[str, Series], states: Mapping[str, np.ndarray], level: float, known: np.ndarray | None = None
) -> dict[str, np.ndarray]:
    """Return what the motion does not take of each run's power, fitted to all, or the `known`, beside what is on."""
    stacked = _stacked(runs, states)
    if known is not None:
        stacked = Series(stacked.time[known], stacked.values[known], stacked.beside[known])
    motion = stacked.coefficients()[:-1]
    if not any(state.any() for state in states.values()):  # nothing is known to be on: the median is neither
        return {name: runs[name].values - runs[name].beside @ motion + level / 2 for name in states}
    return {name: runs[name].values - runs[name].beside @ motion for name in states}


def _apart(pair: Watched, states: Mapping[str, np.ndarray], runs: Mapping[str, Series]) -> np.ndarray:
    """Return where the first run of a pair has the load and the second not (1), or the other way (-1)."""
    time = pair.difference.time
    first, second = (
        np.interp(at, runs[name].time, states[name])
        for name, at in zip(pair.names, (time, time - pair.shift), strict=True)
    )
    return np.asarray(first - second)


def _explained(pairs: Sequence[Watched], states: Mapping[str, np.ndarray], runs: Mapping[str, Series]) -> float:
    """Return the part of what differs, beyond white noise and what follows the motion, that the states explain."""
    before, after = 0.0, 0.0
    for pair in pairs:
        white = len(pair.difference.time) * _white(pair.difference) ** 2
        before += float(np.sum(pair.difference.left() ** 2)) - white
        after += float(np.sum(pair.difference.with_columns(_apart(pair, states, runs)).left() ** 2)) - white
    return 1 - max(after, 0.0) / before if before > 0 else 0.0


def _white(series: Series) -> float:
    """Return the RMS of the white noise: of the second differences, it is six times the mean square."""
    return _SPREAD * float(np.median(np.abs(np.diff(series.values, 2)))) / float(np.sqrt(6))


def _level(
    pairs: Sequence[Watched], states: Mapping[str, np.ndarray], runs: Mapping[str, Series]
) -> tuple[float, float]:
    """Return what is taken more while on, W, with its deviation, by what differs; what is left remembers."""
    right, squares, noise = 0.0, 0.0, 0.0
    for pair in pairs:
        column = _apart(pair, states, runs)
        own = Series(pair.difference.time, column, pair.difference.beside).left()
        left = pair.difference.with_columns(column).left()
        right += float(own @ pair.difference.values)
        squares += float(own @ own)
        noise += float(own @ own) * float(np.mean(left**2)) * correlation_samples(left)
    return (right / squares, float(np.sqrt(noise)) / squares) if squares > 0 else (0.0, 0.0)
