"""Switching: a load that goes on and off beside the robot, told by steps of power that two runs do not share."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.gap.repeats.series import SPREAD, EvenSeries, correlation_samples
from irtwin.gap.repeats.slow import creep

_ROUNDS = 7  # of fitting what the motion takes and what is on, in turn
_BIN = 0.02  # s, over which power is averaged before it is said when a load is on,
_MOST_BINS = 20_000  # or longer, in long runs
_LEAST = 0.05  # of the load: bins are known no better
_BOTH = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]])  # whether it is on in either run

Edges = list[tuple[float, float]]
"""Times, s, and steps, W."""


@dataclass(frozen=True)
class Watched:
    """The power of two runs, `names`, on the first's clock, `shift` s ahead: its `difference`, and its `total`.

    `squares` (N, n): of each joint's torque, as the loss in its winding; None: unknown.
    """

    names: tuple[str, str]
    shift: float
    difference: EvenSeries
    total: EvenSeries
    squares: np.ndarray | None


@dataclass(frozen=True)
class Switching:
    """A load of `level` W with its `deviation`, on where `states` (N,) of each run say one, zero elsewhere.

    `edges`: the times of each run, s, at which it goes on (+) or off (-), told to one of its `bins`; `explained`: its
    part of what differs.
    """

    level: float
    deviation: float
    states: Mapping[str, np.ndarray]
    edges: Mapping[str, Edges]
    bins: Mapping[str, int]
    explained: float

    @property
    def duty(self) -> float:
        """The share of time that it is on."""
        return float(np.mean(np.concatenate(list(self.states.values()))))

    @property
    def cost(self) -> float:
        """What it costs to say when it switches, in nats: which of a run's bins, for each time."""
        return sum(len(self.edges[name]) * float(np.log(self.bins[name])) for name in self.edges)

    @property
    def periods(self) -> list[float]:
        """The times from one switching on to the next, s."""
        on = [[time for time, step in edges if step > 0] for edges in self.edges.values()]
        return [float(value) for times in on for value in np.diff(times)]


def switching(pairs: Sequence[Watched], runs: Mapping[str, EvenSeries]) -> Switching | None:
    """Return the load that switches; None where none explains most of what differs, or a drift says as much.

    `runs`: each run's power by name, with columns beside it that the motion may take.
    """
    names = dict.fromkeys(name for pair in pairs for name in pair.names)
    watched = {name: runs[name] for name in names}
    load = _followed(pairs, watched, _two_levels(watched))
    return load if load is not None and load.explained > 0.5 and _worth(load, pairs, watched) > 0 else None


def _worth(load: Switching, pairs: Sequence[Watched], runs: Mapping[str, EvenSeries]) -> float:
    """Return what a load saves in the description of the runs, beside how they drift, less what its course costs."""
    none = {name: np.zeros(len(series.time)) for name, series in runs.items()}
    before, after = (
        [difference for pair in pairs for difference in _left_of(pair, states, runs)] for states in (none, load.states)
    )
    return saved(before, after) - load.cost


def _left_of(pair: Watched, states: Mapping[str, np.ndarray], runs: Mapping[str, EvenSeries]) -> list[np.ndarray]:
    """Return what a load and a drift leave of the difference of two runs, and of their sum."""
    first, second = _on_first_clock(pair, states, runs)
    both = ((pair.difference, first - second), (pair.total, first + second))
    return [creep(series.with_columns(column), pair.squares).left() for series, column in both]


def _followed(
    pairs: Sequence[Watched], runs: Mapping[str, EvenSeries], states: dict[str, np.ndarray]
) -> Switching | None:
    """Return the load found from a first guess of its course: when it is on, and how high it is, in turn."""
    level, deviation = _level(pairs, states, runs)
    for _ in range(_ROUNDS):
        if level <= 0:
            return None
        left, before = _left(runs, states), level
        differ = [_beside(pair.difference, [_apart(pair, states, runs)]) for pair in pairs]
        for pair, values in zip(reversed(pairs), reversed(differ), strict=True):
            states |= _on(pair, runs, left, values, level)
        level, deviation = _level(pairs, states, runs)
        if abs(level - before) < _LEAST / 10 * level:
            break
    edges = {name: _edges(runs[name].time, state) for name, state in states.items()}
    if level <= 0 or sum(map(len, edges.values())) < 2:
        return None
    bins = {name: len(series.time) // _bin(series) for name, series in runs.items()}
    return Switching(level, deviation, states, edges, bins, _explained(pairs, states, runs))


def _beside(series: EvenSeries, load: Sequence[np.ndarray]) -> np.ndarray:
    """Return the values (N,) without what follows the motion, which is fitted beside the columns of a load."""
    motion = series.with_columns(*load).coefficients()[: series.beside.shape[1]]
    return np.asarray(series.values - series.beside @ motion)


def _on(
    pair: Watched,
    runs: Mapping[str, EvenSeries],
    left: Mapping[str, np.ndarray],
    differ: np.ndarray,
    level: float,
) -> dict[str, np.ndarray]:
    """Return when the load is on in the runs of a pair, by its likeliest course (Viterbi's).

    What they `differ` by says that one has it and not the other; their sum, of what is `left` of each, whether both do.
    """
    first, second = pair.names
    first_series, second_series = runs[first], runs[second]
    own = np.interp(pair.difference.time, first_series.time, left[first])
    other = np.interp(pair.difference.time - pair.shift, second_series.time, left[second])
    measured = [(differ, _BOTH[:, 0] - _BOTH[:, 1]), (own + other, _BOTH.sum(axis=1))]
    size = _bin(first_series)
    count = len(differ) // size
    if count < 2:
        return {}
    pays = np.zeros((count, len(_BOTH)))
    for signal, expected in measured:
        values = np.mean(signal[: count * size].reshape(count, size), axis=1)
        off = (values[:, None] - level * expected) ** 2
        best = np.sqrt(off.min(axis=1))
        variance = float(np.mean(best**2)) * correlation_samples(values - level * expected[off.argmin(axis=1)])
        pays -= off / (2 * max(variance, (_LEAST * level) ** 2))
    course = _likeliest(pays, np.log(count))
    time = pair.difference.time[: count * size : size]
    states = {}
    for k, (name, at) in enumerate(((first, first_series.time), (second, second_series.time + pair.shift))):
        place = np.clip(np.searchsorted(time, at, side="right") - 1, 0, count - 1)
        states[name] = _BOTH[course, k][place]
    return states


def _bin(series: EvenSeries) -> int:
    """Return the samples of a bin."""
    return max(1, round(_BIN * series.rate), -(-len(series.time) // _MOST_BINS))


def _likeliest(pays: np.ndarray, cost: float) -> np.ndarray:
    """Return the likeliest course (T,) through states of log-likelihood (T, S), each switch of some cost."""
    costs = cost * np.abs(_BOTH[:, None] - _BOTH[None]).sum(axis=2)
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


def _stacked(runs: Mapping[str, EvenSeries], states: Mapping[str, np.ndarray]) -> EvenSeries:
    """Return all runs one after the other, with what is on as the last column."""
    parts = [runs[name].with_columns(state) for name, state in states.items()]
    return EvenSeries(
        *(np.concatenate([getattr(part, name) for part in parts]) for name in ("time", "values", "beside"))
    )


def _left(runs: Mapping[str, EvenSeries], states: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Return what the motion does not take of each run's power, fitted to all beside what is on."""
    motion = _stacked(runs, states).coefficients()[:-1]
    return {name: runs[name].values - runs[name].beside @ motion for name in states}


def _apart(pair: Watched, states: Mapping[str, np.ndarray], runs: Mapping[str, EvenSeries]) -> np.ndarray:
    """Return where the first run of a pair has the load and the second not (1), or the other way (-1)."""
    first, second = _on_first_clock(pair, states, runs)
    return np.asarray(first - second)


def _on_first_clock(
    pair: Watched, states: Mapping[str, np.ndarray], runs: Mapping[str, EvenSeries]
) -> tuple[np.ndarray, np.ndarray]:
    """Return when either run of a pair has the load, (N,) each, at the times of their difference."""
    time = pair.difference.time
    first, second = (
        np.interp(at, runs[name].time, states[name])
        for name, at in zip(pair.names, (time, time - pair.shift), strict=True)
    )
    return np.asarray(first), np.asarray(second)


def _explained(pairs: Sequence[Watched], states: Mapping[str, np.ndarray], runs: Mapping[str, EvenSeries]) -> float:
    """Return the part of what differs, beyond white noise and what follows the motion, that the states explain."""
    left = np.zeros(2)
    for pair in pairs:
        second = np.diff(pair.difference.values, 2)  # of white noise, of six times its mean square
        white = len(pair.difference.time) * (SPREAD * float(np.median(np.abs(second)))) ** 2 / 6
        loaded = pair.difference.with_columns(_apart(pair, states, runs))
        left += [float(np.sum(difference.left() ** 2)) - white for difference in (pair.difference, loaded)]
    return float(1 - max(left[1], 0.0) / left[0]) if left[0] > 0 else 0.0


def _level(
    pairs: Sequence[Watched], states: Mapping[str, np.ndarray], runs: Mapping[str, EvenSeries]
) -> tuple[float, float]:
    """Return what is taken more while on, W, with its deviation, by what differs; what is left remembers."""
    right, squares, noise = 0.0, 0.0, 0.0
    for pair in pairs:
        column = _apart(pair, states, runs)
        own = EvenSeries(pair.difference.time, column, pair.difference.beside).left()
        left = pair.difference.with_columns(column).left()
        right += float(own @ pair.difference.values)
        squares += float(own @ own)
        noise += float(own @ own) * float(np.mean(left**2)) * correlation_samples(left)
    return (right / squares, float(np.sqrt(noise)) / squares) if squares > 0 else (0.0, 0.0)


def saved(before: Sequence[np.ndarray], after: Sequence[np.ndarray]) -> float:
    """Return what is saved where residuals `before` become those `after`, (N,) each: their likelihood's logarithm.

    Samples of one series count for fewer, as long as what is left after remembers.
    """
    return sum(map(_saved, before, after))


def _saved(before: np.ndarray, after: np.ndarray) -> float:
    least = np.finfo(float).tiny
    ratio = max(float(np.mean(before**2)), least) / max(float(np.mean(after**2)), least)
    return len(after) / (2 * correlation_samples(after)) * float(np.log(ratio))


def _two_levels(runs: Mapping[str, EvenSeries]) -> dict[str, np.ndarray]:
    """Return where each run's power is on the upper of two levels, (N,) of 0 and 1, beside what the motion takes."""
    states = {name: np.zeros(len(series.time)) for name, series in runs.items()}
    for _ in range(_ROUNDS):
        left = _left(runs, states)
        middle = _middle(np.concatenate(list(left.values())))
        states = {name: (values > middle).astype(float) for name, values in left.items()}
    return states


def _middle(values: np.ndarray) -> float:
    """Return what lies between the two levels that leave the least squares (two means, exactly)."""
    ordered = np.sort(values)
    below, sums = np.arange(1, len(ordered)), np.cumsum(ordered)
    lower, upper = sums[:-1] / below, (sums[-1] - sums[:-1]) / (len(ordered) - below)
    best = int(np.argmax(lower**2 * below + upper**2 * (len(ordered) - below)))
    return float(lower[best] + upper[best]) / 2
