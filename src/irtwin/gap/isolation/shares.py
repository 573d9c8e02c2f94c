"""Shares: how much of what the causes close together each closes, whatever the order they are added in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations
from math import factorial

import numpy as np

from irtwin.gap.isolation.apart import Apart
from irtwin.gap.regression.moments import summed
from irtwin.gap.regression.normal_equations import noise_before
from irtwin.identification.progress import Tell, paced

_EXACT = 8  # causes: 256 subsets
_ORDERS = 40  # drawn, and each reversed, where there are more


def closed_squares(apart: Apart, seed: int, tell: Tell | None = None) -> np.ndarray:
    """Return what each cause closes of the squares of each observed group left out and equation, (C, G, g), as counted.

    Its Shapley value: everything is refitted with every set of causes, up to eight causes exactly, beyond from random
    orders, each beside its reverse. They add up to what all causes close.
    """
    system, players = apart.system, apart.players
    judged = np.flatnonzero(system.group_observed)
    weighed = {True: system.moments(apart.noise), False: system.moments(noise_before(system))}
    told = paced(tell)
    totals = {some: summed(moments) for some, moments in weighed.items()}

    @cache
    def left(members: frozenset[int]) -> np.ndarray:
        chosen = [k for player in sorted(members) for k in players[player]]
        total, moments = totals[bool(members)], weighed[bool(members)]
        found = []
        for group in judged:
            told(f"  what {len(members)} of {len(players)} causes leave, group {group + 1} of {len(moments)}")
            found.append(system.squares(system.solution(chosen, total - moments[group]), int(group)))
        return np.array(found)

    count = len(players)
    values = np.zeros((count, len(judged), len(system.pattern)))
    for player, before, weight in _exact(count) if count <= _EXACT else _drawn(count, seed):
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


def _exact(count: int) -> Iterator[tuple[int, frozenset[int], float]]:
    """Yield every player, every set of others that may stand before it, and the share of orders in which it does."""
    for player in range(count):
        others = [k for k in range(count) if k != player]
        for size in range(count):
            weight = factorial(size) * factorial(count - 1 - size) / factorial(count)
            for before in combinations(others, size):
                yield player, frozenset(before), weight


def _drawn(count: int, seed: int) -> Iterator[tuple[int, frozenset[int], float]]:
    generator = np.random.default_rng(seed)
    for _ in range(_ORDERS):
        order: Sequence[int] = generator.permutation(count).tolist()
        for way in (order, order[::-1]):
            for place, player in enumerate(way):
                yield player, frozenset(way[:place]), 0.5 / _ORDERS
