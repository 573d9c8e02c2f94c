"""The order of places between a first and a last one that takes least in all."""

from __future__ import annotations

import numpy as np

_EXACT = 11  # places between: of more, all orders take too long


def best_order(cost: np.ndarray) -> list[int]:
    """Return the places 0 to m - 1, first and last in their place, in the order that takes least; cost (m, m): row to
    column.

    Exact by dynamic programming (Held and Karp, 1962) for eleven places between; of more, the nearest next and the
    order given, improved by moving stretches of up to three places elsewhere (Or, 1976) until none helps. Where a cost
    is infinite there is no way: where no order goes around all of these, the order given is returned.
    """
    given = list(range(len(cost)))
    if len(cost) - 2 <= _EXACT:
        return _exact(cost) or given
    return min((_improved(cost, order) for order in (given, _nearest(cost))), key=lambda order: length(cost, order))


def length(cost: np.ndarray, order: list[int]) -> float:
    """Return what an order takes."""
    return float(cost[order[:-1], order[1:]].sum())


def _exact(cost: np.ndarray) -> list[int] | None:
    last = len(cost) - 1
    inner = range(1, last)
    least = {(1 << place, place): (float(cost[0, place]), [0, place]) for place in inner}
    for visited in range(1, 1 << last):
        for place in inner:
            if (visited, place) not in least:
                continue
            taken, way = least[visited, place]
            for after in inner:
                key = (visited | 1 << after, after)
                if not visited & 1 << after and taken + cost[place, after] < least.get(key, (np.inf, []))[0]:
                    least[key] = (taken + float(cost[place, after]), [*way, after])
    full = sum(1 << place for place in inner)
    ends = [[*least[full, place][1], last] for place in inner if (full, place) in least]
    return min(ends, key=lambda order: length(cost, order), default=None)


def _nearest(cost: np.ndarray) -> list[int]:
    order, left = [0], set(range(1, len(cost) - 1))
    while left:
        order.append(min(left, key=lambda place: cost[order[-1], place]))
        left.remove(order[-1])
    return [*order, len(cost) - 1]


def _improved(cost: np.ndarray, order: list[int]) -> list[int]:
    better = True
    while better:
        better = False
        for size in (1, 2, 3):
            for start in range(1, len(order) - size):
                moved, rest = order[start : start + size], order[:start] + order[start + size :]
                orders = [rest[:at] + moved + rest[at:] for at in range(1, len(rest))]
                best = min(orders, key=lambda tour: length(cost, tour))
                if length(cost, best) < length(cost, order) * (1 - 1e-12):
                    order, better = best, True
    return order
