"""The order of places that takes least, against all orders."""

from __future__ import annotations

from itertools import permutations

import numpy as np
import pytest

from irtwin.planning import order
from irtwin.planning.order import best_order, length


@pytest.mark.parametrize("places", [2, 3, 6])
def test_no_order_takes_less(places: int) -> None:
    cost = np.random.default_rng(places).uniform(1, 9, (places, places))
    orders = ([0, *inner, places - 1] for inner in permutations(range(1, places - 1)))
    assert length(cost, best_order(cost)) == pytest.approx(min(length(cost, one) for one in orders))


def test_many_places_come_near_the_least(monkeypatch: pytest.MonkeyPatch) -> None:
    at = np.random.default_rng(3).uniform(0, 1, (11, 2))
    cost = np.linalg.norm(at[:, None] - at, axis=2) + 0.1 * at[:, :1]  # uphill takes more
    exact = best_order(cost)
    monkeypatch.setattr(order, "_EXACT", 2)
    found = best_order(cost)
    assert sorted(found) == list(range(11)) and (found[0], found[-1]) == (0, 10)
    assert length(cost, found) <= 1.15 * length(cost, exact)


@pytest.mark.parametrize("at_once", [11, 2])
def test_places_between_which_there_is_no_way_do_not_follow_one_another(
    at_once: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(order, "_EXACT", at_once)
    places = np.array([0, 1, 2, 3, 0, 1, 2, 3])
    cost = np.random.default_rng(5).uniform(1, 9, (8, 8))
    cost[places[:, None] == places] = np.inf
    assert length(cost, best_order(cost)) <= length(cost, list(range(8)))


def test_the_order_given_stays_where_none_goes_around_what_has_no_way() -> None:
    cost = np.ones((5, 5))
    cost[1:4, 1:4] = np.inf
    assert best_order(cost) == [0, 1, 2, 3, 4]
