from __future__ import annotations

import numpy as np
import pytest

from irtwin.effects.effect import Term
from irtwin.identification.accumulate import Block, triangle
from irtwin.identification.estimators import combine, estimate
from irtwin.identification.uncertainty import half_widths


def blocks_of(columns, measured, count=20):
    """One equation a sample, cut into blocks."""
    rows = np.column_stack([columns, measured])
    return [
        Block("run", 0.0, 1.0, np.array([len(part)]), (triangle(part),))
        for part in np.array_split(rows, min(count, len(rows)))
    ]


def all_used(columns):
    return np.ones((1, columns.shape[1]), dtype=bool)


def test_known_truth_is_found():
    rng = np.random.default_rng(0)
    columns = rng.standard_normal((2000, 3)) * [1, 1e3, 1e-3]
    truth = np.array([2.0, -3e-3, 4e3])
    terms = [Term("a", "", spread=10), Term("b", "", spread=1), Term("c", "", spread=1e5)]
    found = estimate(blocks_of(columns, columns @ truth), all_used(columns), terms)
    np.testing.assert_allclose(found.values, truth, rtol=1e-5)


@pytest.mark.parametrize("measured", [0.0, 5e-324, 1e-300])
def test_a_dead_signal_gives_finite_numbers(measured):
    columns = 1e4 * np.random.default_rng(0).standard_normal((500, 2))
    terms = [Term("a", "", expected=3.0, spread=50.0), Term("b", "", spread=15.0, lowest=0.0)]
    found = estimate(blocks_of(columns, np.full(500, measured)), all_used(columns), terms)
    np.testing.assert_allclose(found.values, 0.0, atol=1e-6)
    assert np.isfinite(found.covariance).all()


def test_noisy_equations_count_less():
    rng = np.random.default_rng(1)
    columns = rng.standard_normal((1000, 2))
    truth = np.array([1.0, 2.0])
    noisy = columns @ truth + 10 * rng.standard_normal(1000)
    clean = columns @ truth + 0.01 * rng.standard_normal(1000)
    factors = tuple(triangle(np.column_stack([columns, measured])) for measured in (noisy, clean))
    block = Block("run", 0.0, 1.0, np.array([1000, 1000]), factors)
    found = estimate([block], np.ones((2, 2), dtype=bool), [Term("a", "", spread=10), Term("b", "", spread=10)])
    np.testing.assert_allclose(found.values, truth, atol=2e-3)
    np.testing.assert_allclose(found.noise, [10, 0.01], rtol=0.1)


def test_each_signal_counts_by_how_long_its_own_residuals_remember():
    """Two equations of one coefficient: the first's residuals are held for 50 samples, the second's for none."""
    rng = np.random.default_rng(3)
    columns, blocks = np.ones((5000, 1)), []
    slow = np.repeat(rng.standard_normal(100), 50)
    fast = 0.3 + rng.standard_normal(5000)
    for one, other in zip(np.array_split(slow, 20), np.array_split(fast, 20), strict=True):
        rows = columns[: len(one)]
        factors = tuple(triangle(np.column_stack([rows, measured])) for measured in (one, other))
        blocks.append(Block("run", 0.0, 1.0, np.array([len(one), len(one)]), factors))
    pattern, terms = np.ones((2, 1), dtype=bool), [Term("a", "", spread=10)]
    alike, apart = estimate(blocks, pattern, terms), estimate(blocks, pattern, terms, signals=[0, 1])
    assert alike.values[0] == pytest.approx((slow.mean() + fast.mean()) / 2, abs=0.02)
    assert abs(apart.values[0] - fast.mean()) < abs(alike.values[0] - fast.mean()) / 3
    assert apart.covariance[0, 0] < alike.covariance[0, 0]


def test_what_the_data_leave_open_stays_as_expected():
    rng = np.random.default_rng(2)
    one = rng.standard_normal((500, 1))
    columns = np.hstack([one, one, np.zeros((500, 1))])
    terms = [Term("a", "", expected=1, spread=1), Term("b", "", expected=3, spread=1), Term("c", "", expected=7)]
    found = estimate(blocks_of(columns, 6 * one[:, 0]), all_used(columns), terms)
    np.testing.assert_allclose(found.values, [2, 4, 7], atol=1e-6)  # the sum is seen, the difference is not
    widths = half_widths(found.covariance, np.ones(3), found.blocks)
    assert np.isnan(widths).all()


def test_friction_is_never_negative():
    rng = np.random.default_rng(3)
    columns = rng.standard_normal((300, 2))
    terms = [Term("a", "", spread=5, lowest=0), Term("b", "", spread=5)]
    measured = columns @ [-2.0, 1.0]
    found = estimate(blocks_of(columns, measured), all_used(columns), terms)
    assert found.values[0] == 0.0
    # the other one is that of the fit without the first
    alone = estimate(blocks_of(columns[:, 1:], measured), all_used(columns[:, 1:]), terms[1:])
    assert found.values[1] == pytest.approx(alone.values[0], rel=1e-2)


def test_factors_of_blocks_combine_to_that_of_all_rows():
    rng = np.random.default_rng(4)
    rows = rng.standard_normal((50, 3))
    used = np.array([True, False, True])
    whole = combine([triangle(rows[:20]), triangle(rows[20:])], used)
    assert whole.shape == (3, 4)
    np.testing.assert_allclose(whole.T @ whole, np.insert(np.insert(rows.T @ rows, 1, 0, 0), 1, 0, 1), atol=1e-12)


@pytest.mark.parametrize("correlation", [0.0, 0.95])
def test_intervals_cover_the_truth_though_samples_are_correlated(correlation):
    """Slow regressors under slow noise: intervals that take samples as independent would cover a third of the time."""
    rng = np.random.default_rng(5)
    truth = np.array([1.0, -2.0, 0.5])
    terms = [Term(name, "", spread=100.0) for name in "abc"]
    covered = []
    for _ in range(60):
        columns, noise = smooth(rng, 2000, 3, correlation), smooth(rng, 2000, 1, correlation)[:, 0]
        found = estimate(blocks_of(columns, columns @ truth + noise, count=40), all_used(columns), terms)
        widths = half_widths(found.covariance, np.full(3, 100.0), found.blocks)
        covered.append(np.abs(found.values - truth) <= widths)
    assert 0.9 <= np.mean(covered) <= 0.995


def smooth(rng, rows, columns, correlation):
    from scipy.signal import lfilter

    return lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], rng.standard_normal((rows, columns)), axis=0)
