"""Least squares with lowest values: as a solver of its own finds them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from irtwin.gap.regression.bounded import bounded, bounded_small


def problem(seed, count):
    """Columns that are much alike, so that many coefficients fall below their bounds; the prior's rows are full."""
    random = np.random.default_rng(seed)
    columns = random.normal(size=(60, count)) + random.normal(size=(60, 1))
    prior = random.normal(size=(count, count))
    lowest = np.where(random.random(count) < 0.7, random.normal(size=count), -np.inf)
    return columns, random.normal(size=60), prior, lowest


def solved_otherwise(columns, measured, prior, lowest):
    rows = np.concatenate([columns, prior])
    return lsq_linear(rows, np.append(measured, np.zeros(len(prior))), (lowest, np.inf), method="bvls", tol=1e-14).x


@pytest.mark.parametrize("seed", range(20))
def test_the_fit_is_the_best_within_the_bounds(seed) -> None:
    columns, measured, prior, lowest = problem(seed, 12)
    found, held = bounded(columns.T @ columns, prior.T @ prior, columns.T @ measured, lowest)
    assert np.allclose(found, solved_otherwise(columns, measured, prior, lowest), atol=1e-7)
    assert held.any()
    assert np.array_equal(found[held], lowest[held])
    assert (found >= lowest).all()


def test_without_a_bound_nothing_is_held() -> None:
    columns, measured, prior, _ = problem(1, 5)
    found, held = bounded(columns.T @ columns, prior.T @ prior, columns.T @ measured, np.full(5, -np.inf))
    assert not held.any()
    assert np.allclose(found, np.linalg.solve(columns.T @ columns + prior.T @ prior, columns.T @ measured))


def test_small_systems_are_solved_each_within_its_bounds() -> None:
    problems = [problem(seed, 4) for seed in range(50)]
    normal = np.array([columns.T @ columns + prior.T @ prior for columns, _, prior, _ in problems])
    right = np.array([columns.T @ measured for columns, measured, _, _ in problems])
    found = bounded_small(normal, right, np.array([lowest for *_, lowest in problems]))
    assert np.allclose(found, [solved_otherwise(*one) for one in problems], atol=1e-7)
