"""What a hypothesis does on groups left out, beside a twin whose own coefficients cannot be anything."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.isolation.forward_selection import attribute
from irtwin.gap.regression.cross_validation import attempt, scores
from irtwin.gap.regression.hypotheses import MISSING, Column, Hypothesis, Variant
from irtwin.gap.regression.normal_equations import System, noise_before
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.accumulate import Block, triangle

ROWS, RUNS = 200, 6
EFFECT = catalogue()["cable_drag"]
BOUND = Term("bound", "1", lowest=0.0)
FREE = Term("free", "1")


def system_of(own, tried, measured, terms):
    """A system of one equation: columns of the twin (N, K) with their terms, columns to try (N, M), and the truth."""
    blocks = []
    for run in range(RUNS):
        part = slice(run * ROWS, (run + 1) * ROWS)
        factor = triangle(np.column_stack([own[part], tried[part], measured[part]]))
        blocks.append(Block(f"run_{run}", 0.0, 1.0, np.array([ROWS]), (factor,)))
    columns = tuple(Column(EFFECT, k, Term(f"k{k}", "1", lowest=0.0)) for k in range(tried.shape[1]))
    pattern = np.ones((1, len(terms) + len(columns)), dtype=bool)
    groups, observed = np.arange(RUNS), np.ones(RUNS, dtype=bool)
    system = System(tuple((EFFECT, term) for term in terms), columns, pattern, tuple(blocks), groups, observed)
    candidates = [
        Hypothesis(f"effect_{k}", None, MISSING, (Variant(EFFECT, (len(terms) + k,), (column.term,)),))
        for k, column in enumerate(columns)
    ]
    return system, candidates


@pytest.fixture(scope="module")
def imitated():
    """The twin's free term is what is missing and its bound one together: below its bound, it would hide what is."""
    missing, bound, other, noise = np.random.default_rng(3).standard_normal((4, ROWS * RUNS))
    own = np.column_stack([missing + bound, bound])
    return own, np.column_stack([missing, other]), 5 * missing + noise


def left_out(own, tried, measured, lowest, expected, prior=None):
    """The squares left in each run by fits to the others, each within its bounds, by another solver."""
    rows = np.concatenate([own, tried], axis=1)
    known = np.append(expected, np.zeros(tried.shape[1]))
    rest = measured - rows @ known
    weak = np.eye(rows.shape[1])
    if prior is not None:
        weak[: len(prior), : len(prior)] = prior
    found = []
    for run in range(RUNS):
        inside = np.arange(len(rest)) // ROWS != run
        stacked = np.concatenate([rows[inside], weak])
        target = np.append(rest[inside], np.zeros(len(weak)))
        fitted = lsq_linear(stacked, target, (np.array(lowest) - known, np.inf), method="bvls", tol=1e-14).x
        found.append(np.sum((rest - rows @ fitted)[~inside] ** 2))
    return np.array(found)


@pytest.mark.parametrize("expected", [0.0, 0.7])
def test_fits_on_groups_left_out_are_those_within_the_bounds(imitated, expected) -> None:
    own, tried, measured = imitated
    prior = np.array([[2.0, 0.5], [0.0, 1.5]])
    bound = replace(BOUND, expected=expected)
    system, candidates = system_of(own, tried, measured, (FREE, bound))
    system = replace(system, prior_rows=prior)
    trial = attempt(system, system.moments(np.ones(1)), (), [one.variants for one in candidates])
    start = left_out(own, tried[:, :0], measured, [-np.inf, 0.0], [0.0, expected], prior)
    assert np.allclose(trial.start, start)
    for k in range(2):
        loss = left_out(own, tried[:, [k]], measured, [-np.inf, 0.0, 0.0], [0.0, expected], prior)
        assert np.allclose(trial.loss[k], loss), k


def test_friction_of_the_twin_does_not_turn_negative_to_hide_what_is_missing(imitated) -> None:
    own, tried, measured = imitated
    bounded = system_of(own, tried, measured, (FREE, BOUND))
    assert [cause.effect for cause in attribute(*bounded, seed=0, limits=DEFAULT).causes] == ["effect_0"]
    free = system_of(own, tried, measured, (FREE, FREE))
    assert not attribute(*free, seed=0, limits=DEFAULT).causes


def test_what_the_twin_leaves_is_what_one_leaves_that_can_be_true(imitated) -> None:
    own, tried, measured = imitated
    system, _ = system_of(own, tried, measured, (FREE, BOUND))
    free, _ = system_of(own, tried, measured, (FREE, FREE))
    assert noise_before(free)[0] == pytest.approx(1.0, rel=0.1)
    assert noise_before(system)[0] > 3
    total = np.sum(system.moments(np.ones(1)), axis=0)
    assert system.solution((), total)[1] == 0
    assert system.solution((), total, free=True)[1] == pytest.approx(-5, rel=0.1)


def test_scores_are_of_what_the_bounded_fit_leaves(imitated) -> None:
    own, tried, measured = imitated
    system, _ = system_of(own, tried, measured, (FREE, BOUND))
    moments = system.moments(np.ones(1))
    by_block, products = scores(system, moments, np.ones(1), ())
    total = np.sum(moments, axis=0)
    left = measured - own[:, 0] * system.solution((), total)[0]
    runs = np.arange(len(left)) // ROWS
    loud = np.array([np.sqrt(np.mean(left[runs == run] ** 2)) for run in range(RUNS)])
    direct = np.array([tried[runs == run, 0] @ left[runs == run] for run in range(RUNS)]) / loud
    along = np.array([own[runs == run, 0] @ left[runs == run] for run in range(RUNS)]) / loud
    imitated_by = own[:, 0] @ tried[:, 0] / (own[:, 0] @ own[:, 0] + 1)
    assert np.allclose(by_block[:, 2], direct - imitated_by * along, rtol=1e-6)
    assert products[-1, -1] == pytest.approx(np.sum(left**2), rel=1e-2)
