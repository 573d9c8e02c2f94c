"""Evidence where residuals remember longer than a block of time lasts."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from irtwin.effects.effect import Term
from irtwin.gap.isolation.memory import _shrunk
from irtwin.gap.regression.hypotheses import Hypothesis, Variant
from irtwin.gap.regression.significance import likeness, p_values
from irtwin.identification.accumulate import Block

DRIFT = Hypothesis("drift", "j", "missing", (Variant(None, (0,), (Term("r", "1"),)),))


def blocks(count, runs=1, seconds=0.2):
    """Blocks of some runs, one after the other."""
    per_run = count // runs
    return [
        Block(f"run_{k // per_run}", k % per_run * seconds, (k % per_run + 1) * seconds, np.ones(1), ())
        for k in range(count)
    ]


def false_alarms(memory, told, count=60, trials=150):
    """How often a slow column beats 95 of 100 chances in noise that remembers `memory` s, by what p is `told` of it."""
    rng, each, false = np.random.default_rng(0), blocks(count), 0
    root = np.linalg.cholesky(likeness(each, memory / 2))
    column = np.linspace(-1, 1, count)
    for seed in range(trials):
        scores = (column * (root @ rng.standard_normal(count)))[:, None]
        products = SimpleNamespace(each=lambda sets: dict.fromkeys(sets, np.array([[float(column @ column)]])))
        p = p_values(scores, products, [DRIFT], seed, likeness(each, told) if told else None, flips=199)
        false += p[0] <= 0.05
    return false / trials


def test_signs_of_blocks_take_a_wandering_residual_for_an_effect():
    assert false_alarms(memory=2.0, told=None) > 0.25


def test_draws_as_alike_as_the_residual_do_not():
    assert false_alarms(memory=2.0, told=2.0) < 0.1


def test_blocks_that_nothing_joins_are_as_with_signs():
    assert false_alarms(memory=1e-3, told=1e-3) < 0.1
    np.testing.assert_allclose(likeness(blocks(4), 1e-3), np.eye(4), atol=1e-6)


def test_blocks_of_two_runs_are_not_alike():
    alike = likeness(blocks(4, runs=2), 10.0)
    assert alike[0, 1] > 0.9 and alike[2, 3] > 0.9
    assert alike[0, 2] == alike[1, 3] == 0


@pytest.mark.parametrize("memory, runs, low, high", [(1e-3, 1, 0.99, 1.0), (4.0, 1, 0.2, 0.6), (4.0, 8, 0.99, 1.0)])
def test_t_between_stretches_of_one_run_shrinks_as_they_are_alike(memory, runs, low, high):
    group = np.repeat(np.arange(8), 2)
    assert low <= _shrunk(likeness(blocks(16, runs=runs), memory), group) <= high + 1e-6
