from __future__ import annotations

import numpy as np
import pytest

from irtwin.identification.accumulate import Block, triangle
from irtwin.identification.uncertainty import covariance, half_widths

PATTERN = np.ones((1, 2), dtype=bool)


def found(columns, measured, values, spread, count=25):
    rows = np.column_stack([columns, measured])
    blocks = [Block("run", 0, 1, np.array([len(part)]), (triangle(part),)) for part in np.array_split(rows, count)]
    noise = np.array([1.0])
    return covariance(blocks, PATTERN, [triangle(rows)], values, noise, spread, np.eye(len(spread)))


def test_independent_noise_gives_the_textbook_covariance():
    rng = np.random.default_rng(0)
    columns, noise = rng.standard_normal((20000, 2)), rng.standard_normal(20000)
    spread = np.array([100.0, 100.0])
    result, effect = found(columns, noise, np.zeros(2), spread, count=2000)
    assert effect == pytest.approx(1.0, abs=0.1)
    np.testing.assert_allclose(np.diag(result), np.diag(np.linalg.inv(columns.T @ columns)), rtol=0.1)


def test_samples_that_repeat_each_other_count_once():
    rng = np.random.default_rng(1)
    columns, noise = rng.standard_normal((2000, 2)), rng.standard_normal(2000)
    many = np.repeat(columns, 5, axis=0), np.repeat(noise, 5)
    result, effect = found(*many, np.zeros(2), np.array([100.0, 100.0]), count=500)
    assert effect == pytest.approx(5, rel=0.2)
    np.testing.assert_allclose(np.diag(result), np.diag(np.linalg.inv(columns.T @ columns)), rtol=0.2)


def test_what_was_not_seen_keeps_the_spread_of_the_prior():
    columns = np.column_stack([np.ones(100), np.zeros(100)])
    result, _ = found(columns, np.ones(100), np.array([1.0, 3.0]), np.array([50.0, 7.0]))
    assert result[1, 1] == pytest.approx(49.0)
    widths = half_widths(result, np.array([50.0, 7.0]), 25)
    assert np.isfinite(widths[0]) and np.isnan(widths[1])


def test_almost_exact_data_do_not_hide_what_was_not_seen():
    columns = 1e9 * np.ones((100, 2))
    result, _ = found(columns, np.zeros(100), np.zeros(2), np.array([1.0, 1.0]))
    np.testing.assert_allclose(result, [[0.5, -0.5], [-0.5, 0.5]], atol=1e-4)


def test_few_blocks_widen_the_interval():
    widths = [half_widths(np.eye(1), np.array([10.0]), blocks)[0] for blocks in (2, 5, 1000)]
    assert widths[0] == pytest.approx(12.706, rel=1e-3)
    assert widths[1] == pytest.approx(2.776, rel=1e-3)
    assert widths[2] == pytest.approx(1.962, rel=1e-3)
