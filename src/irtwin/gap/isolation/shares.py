"""Shares: how much of what the causes close together each closes, whatever the order they are added in."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import combinations
from math import factorial

import numpy as np

from irtwin.gap.isolation.forward_selection import Attribution
from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.normal_equations import System

_EXACT = 8  # causes: 256 subsets
_ORDERS = 40  # drawn, and each reversed, where there are more


def shares(system: System, found: Attribution, seed: int) -> tuple[float, ...]:
    """Return each cause's Shapley value of the squares closed on observed groups left out, as a part of their sum.

    Squares count in units of the noise; everything is refitted with every set of causes. Up to eight causes exactly,
    beyond from random orders, each beside its reverse. None of them (an empty tuple) where nothing is closed. A cause
    that only spoils the fit of held-out runs has a share below zero.
    """
    players = [cause.columns for cause in found.causes]
    if not players:
        return ()
    if len(players) == 1:
        return (1.0,)
    moments = system.moments(found.noise)
    judged = np.flatnonzero(system.group_observed)
    total = np.sum(moments, axis=0)
    rest = {int(group): total - moments[group] for group in judged}

    @cache
    def closed(members: frozenset[int]) -> float:
        chosen = [k for player in sorted(members) for k in players[player]]
        inside = np.array([*range(system.base), *chosen], dtype=int)
        every = np.append(inside, len(total) - 1)
        left = 0.0
        for group, train in rest.items():
            factor = factored(train[np.ix_(inside, inside)], system.prior(chosen))
            vector = np.append(-solved(factor, train[inside, -1]), 1.0)
            left += float(vector @ moments[group][np.ix_(every, every)] @ vector)
        return -left

    count = len(players)
    values = np.zeros(count)
    for player, before, weight in _exact(count) if count <= _EXACT else _drawn(count, seed):
        values[player] += weight * (closed(before | {player}) - closed(before))
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
