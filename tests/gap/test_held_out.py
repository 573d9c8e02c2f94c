"""How much of a gap is closed, on groups whose squares are known."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.gap.regression.held_out import HeldOut, closed_fraction

FLOOR = np.array([1.0])


def judged(before, after):
    """One row a group, so that squares are mean squares."""
    return HeldOut(np.asarray(before, float), np.asarray(after, float), np.ones(np.shape(before)))


def test_what_lies_above_the_floor_counts():
    value, interval = closed_fraction([(judged([[5.0]] * 4, [[2.0]] * 4), FLOOR)], seed=0)
    assert value == pytest.approx(0.75)
    assert interval == pytest.approx([0.75, 0.75])


def test_an_equation_without_a_gap_has_nothing_to_close():
    with_one = judged([[5.0, 0.4]] * 4, [[2.0, 0.4]] * 4)
    value, _ = closed_fraction([(with_one, np.array([1.0, 1.0]))], seed=0)
    assert value == pytest.approx(0.75)
    assert closed_fraction([(judged([[0.4]] * 4, [[0.4]] * 4), FLOOR)], seed=0) is None


def test_no_more_than_all_is_closed():
    value, (_, upper) = closed_fraction([(judged([[5.0], [4.0]], [[0.5], [0.6]]), FLOOR)], seed=0)
    assert value == upper == 1.0


@pytest.mark.slow
def test_the_interval_covers_the_truth_nineteen_times_in_twenty():
    generator = np.random.default_rng(3)
    covered = []
    for _ in range(200):
        gap = generator.lognormal(1.0, 0.7, (6, 1))
        left = 0.2 * gap * generator.uniform(0.5, 1.5, gap.shape)
        _, (lower, upper) = closed_fraction([(judged(1 + gap, 1 + left), FLOOR)], seed=0)
        covered.append(lower <= 0.8 <= upper)
    assert 0.90 <= np.mean(covered) <= 0.98
