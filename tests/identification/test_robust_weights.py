from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irtwin.document.odd_stretch import OddStretch
from irtwin.effects.effect import Term
from irtwin.identification.accumulate import Block, triangle
from irtwin.identification.estimators import estimate
from irtwin.identification.robust_weights import odd_stretches, robust_weights

TERMS = [Term("a", "", spread=100), Term("b", "", spread=100)]
TRUTH = np.array([10.0, 20.0])


def blocks(spoil=lambda measured, at: measured, count=40, rows=50):
    """Blocks of one equation with noise of one, what was measured in each `spoil`ed."""
    rng, made = np.random.default_rng(5), []
    for at in range(count):
        columns = rng.normal([0.0, 1.0], 1.0, (rows, 2))
        measured = spoil(columns @ TRUTH + rng.standard_normal(rows), at)
        factor = triangle(np.column_stack([columns, measured]))
        made.append(Block("run", float(at), at + 1.0, np.array([rows]), (factor,)))
    return made


def least_squares(some):
    rows = np.concatenate([block.factors[0] for block in some])
    return np.linalg.lstsq(rows[:, :2], rows[:, 2])[0]


@pytest.mark.parametrize(
    "spoil",
    [
        lambda measured, at: measured + 60 * (at in (7, 8)),
        lambda measured, at: measured * (at != 7) * (at != 8),
        lambda measured, at: measured * (3 if at > 35 else 1),
    ],
    ids=["pushed", "dropped out", "loaded"],
)
def test_a_stretch_that_is_not_the_robots_own_decides_little(spoil):
    found = estimate(blocks(spoil), np.ones((1, 2), dtype=bool), TERMS)
    off = np.linalg.norm(found.values - TRUTH)
    assert off < 0.12 and off < 0.2 * np.linalg.norm(least_squares(blocks(spoil)) - TRUTH)
    assert 0.8 < found.noise[0] < 2


def test_without_such_a_stretch_it_is_least_squares():
    found = estimate(blocks(), np.ones((1, 2), dtype=bool), TERMS)
    np.testing.assert_allclose(found.values, least_squares(blocks()), atol=0.01)
    assert 0.5 < found.weights.min() < found.weights.max() < 1.25


@given(sizes=st.lists(st.floats(0, 1e6), min_size=2, max_size=9), unit=st.floats(1e-100, 1e100))
def test_what_leaves_more_counts_less_whatever_the_unit(sizes, unit):
    squares, rows = np.array(sorted(sizes)) ** 2 * 10, np.full(len(sizes), 10)
    weights = robust_weights(squares, rows, 1.0, 0.0)
    assert np.all(weights > 0) and np.all(np.diff(weights) <= 1e-12) and weights.mean() == pytest.approx(1.0)
    np.testing.assert_allclose(robust_weights(squares * unit**2, rows, unit, 0.0), weights)


def test_blocks_in_a_row_are_one_stretch_with_the_joints_that_show_it_the_worst_first():
    made = [Block(run, at, at + 1, np.array([1, 1]), ()) for run in ("one", "two") for at in (0.0, 1.0, 2.0)]
    weights = np.ones((6, 2))
    weights[1, 1] = weights[2, 0] = weights[3, 0] = 0.05
    weights[5, 1] = 0.02
    assert odd_stretches(made, weights, ("a", "b")) == (
        OddStretch(run="two", start=2.0, stop=3.0, joints=("b",)),
        OddStretch(run="one", start=1.0, stop=3.0, joints=("a", "b")),
        OddStretch(run="two", start=0.0, stop=1.0, joints=("a",)),
    )
