"""What causes close: of groups whose squares are known."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.gap.isolation.closing import Closing, closed_fraction, closing
from irtwin.gap.regression.held_out import HeldOut
from irtwin.gap.thresholds import DEFAULT

GROUPS, ROWS = 8, 100
LIMITS = DEFAULT.matters


def closed(mean, before=(5.0, 1.0), floor=(1.0, 1.0), acting=None, spread=0.0):
    """What is closed of two joints' mean squares `before`, in the mean over groups; `spread`: it varies by so much."""
    rows = np.full((GROUPS, 2), float(ROWS))
    squares = np.array(mean) * ROWS * (1 + spread * np.cos(np.pi * np.arange(GROUPS)))[:, None]
    held_out = HeldOut(np.array(before) * rows, np.array(before) * rows - squares, rows)
    acts = np.ones(GROUPS, dtype=bool) if acting is None else acting
    return closing(squares, acts, held_out, None if floor is None else np.array(floor), np.ones(2))


def test_a_share_is_of_the_gap_above_the_floor() -> None:
    one = closed([2.0, 0.0])
    assert one.share == pytest.approx(0.5)
    assert one.interval == pytest.approx((0.5, 0.5))
    assert one.floors == pytest.approx(np.sqrt(2))
    assert one.size == pytest.approx(2)


def test_without_a_floor_joints_count_alike_by_their_mean_square() -> None:
    one = closed([5.0, 0.0], before=(10.0, 0.1), floor=None)
    assert one.share == pytest.approx(0.25)
    assert one.floors is None


def test_no_gap_has_no_share() -> None:
    one = closed([0.5, 0.5], before=(0.9, 0.9))
    assert one.share == 0
    assert not one.matters(LIMITS)


def test_what_differs_between_groups_widens_the_interval() -> None:
    steady, uneven = closed([2.0, 0.0], spread=0.1), closed([2.0, 0.0], spread=3.0)
    assert steady.interval[0] > 0 > uneven.interval[0]
    assert steady.matters(LIMITS)
    assert not uneven.matters(LIMITS)


def test_floors_count_where_a_cause_acts() -> None:
    some = np.arange(GROUPS) < 2
    rows = np.full((GROUPS, 2), float(ROWS))
    squares = np.where(some, 1.0, 0.0)[:, None] * rows * [1.0, 0.0]
    held_out = HeldOut(2 * rows, 2 * rows - squares, rows)
    assert closing(squares, some, held_out, np.ones(2), np.ones(2)).floors == pytest.approx(1)


def test_a_gap_in_few_groups_that_closes_in_each_is_sure() -> None:
    """A winding that is warm in one run: sets of groups without that run have no gap to be a share of."""
    rows = np.full((GROUPS, 1), float(ROWS))
    before = rows * np.where(np.arange(GROUPS) == 0, 30.0, 0.95)[:, None]
    squares = np.where(np.arange(GROUPS) == 0, 0.93 * 29 * ROWS, 0.0)[:, None]
    one = closing(squares, np.ones(GROUPS, dtype=bool), HeldOut(before, before, rows), np.ones(1), np.ones(1))
    assert one.interval[0] > 0.8


@pytest.mark.parametrize(
    "one",
    [
        Closing(share=6.6e-9, interval=(1e-9, 2e-8), floors=900.0, size=1.0),
        Closing(share=0.9, interval=(0.8, 0.95), floors=0.1, size=0.01),
        Closing(share=0.018, interval=(-0.012, 0.049), floors=4.0, size=1.0),
        Closing(share=0.6, interval=(-0.1, 1.0), floors=4.0, size=1.0),
    ],
    ids=["nothing of a large gap", "less than noise", "perhaps nothing", "perhaps nothing of much"],
)
def test_what_a_person_would_not_miss_does_not_matter(one: Closing) -> None:
    assert not one.matters(LIMITS)


def test_a_cause_that_is_likely_matters_however_unsure_it_is_what_it_closes() -> None:
    assert Closing(share=0.27, interval=(-0.17, 0.72), floors=1.0, size=1.0).matters(LIMITS, likely=True)
    assert not Closing(share=0.27, interval=(-0.17, 0.72), floors=0.4, size=1.0).matters(LIMITS, likely=True)
    assert not Closing(share=0.01, interval=(-0.17, 0.72), floors=1.0, size=1.0).matters(LIMITS, likely=True)


def test_what_a_person_would_miss_matters() -> None:
    assert closed([2.0, 0.0]).matters(LIMITS) is True
    assert Closing(share=0.03, interval=(0.01, 0.05), floors=0.6, size=0.4).matters(LIMITS)
    assert Closing(share=0.03, interval=(0.01, 0.05), floors=None, size=0.4).matters(LIMITS)


FLOOR = np.array([1.0])


def judged(before, after):
    """One row a group, so that squares are mean squares."""
    return HeldOut(np.asarray(before, float), np.asarray(after, float), np.ones(np.shape(before)))


def test_what_lies_above_the_floor_counts():
    value, interval = closed_fraction([(judged([[5.0]] * 4, [[2.0]] * 4), FLOOR)])
    assert value == pytest.approx(0.75)
    assert interval == pytest.approx([0.75, 0.75])


def test_an_equation_without_a_gap_has_nothing_to_close():
    with_one = judged([[5.0, 0.4]] * 4, [[2.0, 0.4]] * 4)
    value, _ = closed_fraction([(with_one, np.array([1.0, 1.0]))])
    assert value == pytest.approx(0.75)
    assert closed_fraction([(judged([[0.4]] * 4, [[0.4]] * 4), FLOOR)]) is None


def test_no_more_than_all_is_closed():
    value, (_, upper) = closed_fraction([(judged([[5.0], [4.0]], [[0.5], [0.6]]), FLOOR)])
    assert value == upper == 1.0


@pytest.mark.slow
def test_the_interval_covers_the_truth_nineteen_times_in_twenty():
    generator = np.random.default_rng(3)
    covered = []
    for _ in range(200):
        gap = generator.lognormal(1.0, 0.7, (6, 1))
        left = 0.2 * gap * generator.uniform(0.5, 1.5, gap.shape)
        _, (lower, upper) = closed_fraction([(judged(1 + gap, 1 + left), FLOOR)])
        covered.append(lower <= 0.8 <= upper)
    assert 0.90 <= np.mean(covered) <= 0.98
