"""Normal equations under the prior are solved, also where columns are one another's multiples."""

from __future__ import annotations

import numpy as np

from irtwin.gap.regression.cholesky import factored, solved


def test_the_solution_is_that_of_ridge_regression() -> None:
    random = np.random.default_rng(1)
    columns, right = random.normal(size=(50, 4)), random.normal(size=(4, 2))
    products = columns.T @ columns
    assert np.allclose(solved(factored(products), right), np.linalg.solve(products + np.eye(4), right))


def test_columns_so_large_that_rounding_hides_the_prior_are_solved() -> None:
    columns = np.random.default_rng(2).normal(size=(50, 1)) * 1e12 @ np.ones((1, 3))
    found = solved(factored(columns.T @ columns), columns.T @ columns[:, 0])
    assert np.isfinite(found).all()
    assert np.allclose(columns @ found, columns[:, 0], rtol=1e-3)
