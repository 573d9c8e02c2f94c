"""Products held equation by equation are those of all columns, in whichever form they are held."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from irtwin.gap.regression import moments as module
from irtwin.gap.regression.moments import Moments, Places, Products, Summed, Whole, numbers

COLUMNS = 9  # and the measurement
WEIGHTS = np.array([2.0, 0.5, 3.0])


def group(rng: np.random.Generator, count: int, used: list[list[int]]) -> tuple[Moments, np.ndarray]:
    """Moments of three equations with these columns, column 8 the same as column 7; and the products of all."""
    whole, every = np.zeros((COLUMNS + 1, COLUMNS + 1)), []
    for own, weight in zip(used, WEIGHTS, strict=True):
        rows, scale = rng.standard_normal((count, len(own) + 1)), rng.uniform(0.5, 2, len(own) + 1)
        twice = [own.index(7)] if 7 in own else []
        held = np.array([*range(len(own)), *twice, len(own)])
        places = Places(np.array([*own, *[8 for _ in twice], COLUMNS]), held, COLUMNS + 1)
        every.append(Products.of(places, rows, scale))
        full = np.zeros((count, COLUMNS + 1))
        full[:, places.every] = (rows * scale)[:, held]
        whole += weight * full.T @ full
        sums = rng.standard_normal(COLUMNS + 1)
        assert every[-1].squares(sums) == pytest.approx(float(((full @ sums) ** 2).sum()))
        one, other = rng.integers(0, len(held), (2, 5))
        products = (full.T @ full)[places.every[one], places.every[other]]
        np.testing.assert_allclose(every[-1].pairs(held[one], held[other]), products, atol=1e-9)
        assert every[-1].largest == pytest.approx((full[:, :-1] ** 2).sum(axis=0).max())
        assert every[-1].held.size >= numbers(*rows.shape)
    return Moments(list(zip(every, WEIGHTS.tolist(), strict=True))), whole


@settings(max_examples=40)
@given(
    st.integers(1, 12),
    st.lists(st.lists(st.integers(0, 7), unique=True).map(sorted), min_size=3, max_size=3),
    st.integers(0, 2**32 - 1),
)
def test_they_are_the_products_of_all_columns(count, used, seed):
    rng = np.random.default_rng(seed)
    (one, first), (other, second) = group(rng, count, used), group(rng, 2 * count, used)
    for found, expected in ((one, first), (Whole(one), first), (Summed([one, other]), first + second)):
        np.testing.assert_allclose(found.of(np.arange(found.size)), expected, atol=1e-9)
        rows, columns = rng.integers(0, COLUMNS + 1, 4), rng.permutation(COLUMNS + 1)[:6]
        np.testing.assert_allclose(found.among(rows, columns), expected[np.ix_(rows, columns)], atol=1e-9)


def test_many_columns_of_few_rows_are_held_as_rows(monkeypatch):
    assert numbers(10, 40) == 1600
    assert numbers(10, 41) == 410
    used = [[0, 1, 7], [2, 7], [3, 4, 5]]
    products, _ = group(np.random.default_rng(1), 6, used)
    monkeypatch.setattr(module, "_AS_ROWS", 0)
    rows, _ = group(np.random.default_rng(1), 6, used)
    np.testing.assert_allclose(rows.of(np.arange(rows.size)), products.of(np.arange(products.size)), atol=1e-12)


def test_an_equation_knows_nothing_of_columns_that_it_lacks():
    products, _ = group(np.random.default_rng(0), 6, [[0, 1], [2, 3], [4]])
    whole = products.of(np.arange(products.size))
    assert not whole[np.ix_([0, 1], [2, 3, 4])].any()
    assert not whole[5:9].any()
    assert whole[9, 9] > 0
