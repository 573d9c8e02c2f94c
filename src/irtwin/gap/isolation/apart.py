"""A channel's equations as a gap is judged by them: rows in which dry friction turns stand apart.

Nobody knows the law of friction there. What causes leave of these rows is their noise, and no gap, unless reference
runs leave far less; what they close of them counts by it.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from itertools import combinations
from math import factorial

import numpy as np

from irtwin.gap.regression.groups import FEWEST_GROUPS
from irtwin.gap.regression.held_out import HeldOut, held_out
from irtwin.gap.regression.moments import Summed, Whole
from irtwin.gap.regression.normal_equations import System, observed_rms, reference_rms
from irtwin.identification.progress import track

_DRAWN = 32  # partitions into halves; of five groups there are ten
_EXACT = 8  # causes: 256 subsets
_ORDERS = 40  # drawn, and each reversed, where there are more


@dataclass(frozen=True)
class Apart:
    """`plain`: the equations of the twin as it is; `system`: with the causes, each one's columns in it `players`.

    `likely`: whether each is there more likely than not.
    """

    plain: System
    system: System
    players: tuple[list[int], ...]
    likely: tuple[bool, ...]

    @classmethod
    def of(cls, plain: System, system: System, causes: Sequence[Sequence[int]], likely: Sequence[bool]) -> Apart:
        """Take of a channel's equations the terms of the twin, and the causes' columns, alone."""
        kept, places = system.with_columns([k for columns in causes for k in columns])
        ends = np.cumsum([len(columns) for columns in causes])
        players = tuple(places[end - len(columns) : end] for end, columns in zip(ends, causes, strict=True))
        return cls(plain.with_columns(())[0].by_speed, kept.by_speed, players, tuple(likely))

    @property
    def chosen(self) -> list[int]:
        """The columns of all causes."""
        return [k for columns in self.players for k in columns]

    @cached_property
    def noise(self) -> np.ndarray:
        """(g,), of rows apart (2 g,), RMS that the causes leave."""
        return self.system.residual_rms(self.chosen, self.system.noise_before)

    @cached_property
    def left(self) -> tuple[np.ndarray, np.ndarray]:
        """(g,) RMS left in observed runs by fits to all runs, without causes and with them, where the law is known."""
        known = self.plain.halves[0]
        before = observed_rms(self.plain, (), self.plain.noise_before)
        return before[known], observed_rms(self.system, self.chosen, self.noise)[known]

    @cached_property
    def known(self) -> np.ndarray:
        """(g,) the part of observed runs' rows in which the law of friction is known."""
        rows = self.plain.rows[self.plain.group_observed].sum(axis=0)
        every = np.maximum(sum(rows[half] for half in self.plain.halves), 1)
        return np.asarray(rows[self.plain.halves[0]] / every)

    def level(self, floor: np.ndarray) -> np.ndarray:
        """Return (g,) RMS beyond which a gap lies: the floor (g,), or what the other runs show, if that is more."""
        if not self.plain.both:
            return floor
        known = reference_rms(self.plain, self.plain.noise_before)[self.plain.halves[0]]
        return np.asarray(np.maximum(floor, known))

    def turned(self, floor: np.ndarray) -> np.ndarray:
        """Return (g,) by how much causes leave more, where dry friction turns, than reference runs over one another.

        In squares of what these leave there, or of the floor (g,) RMS, if that is more; minus infinity where too few
        reference runs tell.
        """
        turning = self.plain.halves[-1]
        known = spread(self.plain, floor, turning) if len(self.plain.halves) > 1 else None
        if known is None:
            return np.full(len(floor), -np.inf)
        level = np.maximum(floor, reference_rms(self.plain, self.plain.noise_before)[turning])
        left = observed_rms(self.system, self.chosen, self.noise)[turning]
        return np.asarray((left / level) ** 2 - 1 - known)

    def counted(self, squares: np.ndarray) -> np.ndarray:
        """Return squares of rows apart (..., 2 g) together, (..., g): slow ones in units of the noise of the others."""
        first = self.system.halves[0]
        weights = (self.noise[first] / np.stack([self.noise[half] for half in self.system.halves])) ** 2
        return np.asarray(sum(squares[..., half] * own for half, own in zip(self.system.halves, weights, strict=True)))

    def held_out(self) -> HeldOut:
        """Return the squares of each observed group left out, counted so."""
        apart = held_out(self.system, self.plain.noise_before, self.noise, self.chosen, self.plain)
        rows = np.asarray(sum(apart.rows[:, half] for half in self.system.halves))
        return HeldOut(self.counted(apart.before), self.counted(apart.after), rows)


def spread(system: System, floor: np.ndarray, rows: slice) -> float | None:
    """Return the largest excess, in floors squared, of a half of the reference groups over the other half.

    Each half in turn plays the observed runs: what a fit to both leaves in it is held against what a fit to the other
    half leaves there, or the floor (g,) RMS if that is more, in the equations of some `rows`, a half of the system's.
    The largest of all equations and halves; None where the groups are fewer than four.
    """
    groups = [int(group) for group in np.flatnonzero(~system.group_observed)]
    if len(groups) < FEWEST_GROUPS:
        return None
    noise = system.noise_before

    def left(fitted: Sequence[int], of: Sequence[int]) -> np.ndarray:
        return system.rms((), noise, fitted, of)[rows]

    def excess(played: Sequence[int], others: Sequence[int]) -> float:
        return float(np.max((left(groups, played) / np.maximum(floor, left(others, others))) ** 2 - 1))

    return max(excess(*halves) for halves in _halves(groups))


def _halves(groups: list[int]) -> Iterator[tuple[list[int], list[int]]]:
    """Yield each partition into halves that is drawn, both ways round."""
    generator = np.random.default_rng(0)
    drawn = (generator.permutation(groups)[: len(groups) // 2] for _ in range(_DRAWN))
    for half in dict.fromkeys(frozenset(some.tolist()) for some in drawn):
        first, second = sorted(half), sorted(set(groups) - half)
        yield first, second
        yield second, first


def closed_squares(apart: Apart) -> np.ndarray:
    """Return what each cause closes of the squares of each observed group left out and equation, (C, G, g), as counted.

    Its Shapley value: everything is refitted with every set of causes, up to eight causes exactly, beyond from random
    orders, each beside its reverse. They add up to what all causes close. A guess closes what the likely causes leave:
    one that only spoils the fit is not held against them.
    """
    system, players = apart.system, apart.players
    judged = np.flatnonzero(system.group_observed)
    noise = {True: apart.noise, False: system.noise_before}
    weighed = {some: [Whole(moments) for moments in system.group_moments(level)] for some, level in noise.items()}
    totals = {some: Summed(moments) for some, moments in weighed.items()}

    @cache
    def left(members: frozenset[int]) -> np.ndarray:
        chosen = [k for player in sorted(members) for k in players[player]]
        total, moments = totals[bool(members)], weighed[bool(members)]
        return np.array([system.squares_without(chosen, total, moments[group], int(group)) for group in judged])

    values = np.zeros((len(players), len(judged), len(system.pattern)))
    for player, before, weight in track(_orders(apart.likely), "what causes leave, each set of them"):
        values[player] += weight * (left(before) - left(before | {player}))
    return apart.counted(values)


def shares(closed: np.ndarray, rows: np.ndarray, level: np.ndarray) -> tuple[float, ...]:
    """Return each cause's part of the mean squares that all close, `closed` (C, G, g), in units of a `level` (g,), RMS.

    rows: (G, g). None of them (an empty tuple) where nothing is closed. A cause that only spoils the fit of held-out
    runs has a share below zero.
    """
    values = (closed.sum(axis=1) / np.maximum(rows.sum(axis=0), 1) / level**2).sum(axis=1)
    together = float(values.sum())
    return tuple(float(value) / together for value in values) if together > 0 else ()


def _orders(likely: Sequence[bool]) -> Iterator[tuple[int, frozenset[int], float]]:
    """Yield every player, each set of others that may stand before it, and the share of orders in which it does."""
    earlier: frozenset[int] = frozenset()
    for some in (np.flatnonzero(likely).tolist(), np.flatnonzero(np.logical_not(likely)).tolist()):
        for player, before, weight in _exact(some) if len(some) <= _EXACT else _drawn(some):
            yield player, earlier | before, weight
        earlier |= set(some)


def _exact(players: Sequence[int]) -> Iterator[tuple[int, frozenset[int], float]]:
    count = len(players)
    for player in players:
        others = [k for k in players if k != player]
        for size in range(count):
            weight = factorial(size) * factorial(count - 1 - size) / factorial(count)
            for before in combinations(others, size):
                yield player, frozenset(before), weight


def _drawn(players: Sequence[int]) -> Iterator[tuple[int, frozenset[int], float]]:
    generator = np.random.default_rng(0)
    for _ in range(_ORDERS):
        order: Sequence[int] = generator.permutation(players).tolist()
        for way in (order, order[::-1]):
            for place, player in enumerate(way):
                yield player, frozenset(way[:place]), 0.5 / _ORDERS
