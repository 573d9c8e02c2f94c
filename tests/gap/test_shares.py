"""Shares of causes, and what reference runs leave over one another, in systems whose squares are known."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.gap.test_structure_search import block, equation

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.isolation.apart import Apart, closed_squares, shares, spread
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.structure_search import Attribution
from irtwin.gap.regression.held_out import held_out
from irtwin.gap.regression.hypotheses import MISSING, CandidateColumn, Variant

ROWS, RUNS = 400, 5
EFFECT = catalogue()["cable_drag"]


def system_of(mix, coefficients, noise=1.0, size=30.0):
    """Columns that are mixtures (rows of `mix`) of independent ones, each a cause, and what they add up to."""
    generator = np.random.default_rng(0)
    blocks = []
    for run in range(RUNS):
        independent = np.linalg.qr(generator.standard_normal((ROWS, len(mix[0]))))[0] * np.sqrt(ROWS)
        columns = size * independent @ np.array(mix).T
        measured = columns @ coefficients + noise * generator.standard_normal(ROWS)
        blocks.append(block(run, np.ones(ROWS), columns, measured))
    columns = [CandidateColumn(EFFECT, k, Term(f"k{k}", "1")) for k in range(len(mix))]
    system = equation(blocks, [(EFFECT, Term("constant", "1"))], columns)
    causes = tuple(
        FoundCause(f"effect_{k}", MISSING, (), (Variant(EFFECT, (1 + k,), (column.term,)),), 1.0, 9.0, 0.0)
        for k, column in enumerate(columns)
    )
    return system, Attribution(causes, np.array([noise]), (), np.zeros((0, 2)), np.zeros(0))


def apart(system, attribution):
    causes = attribution.causes
    return Apart.of(system, system, [cause.columns for cause in causes], [cause.likely for cause in causes])


def shared(system, attribution):
    return shares(closed_squares(apart(system, attribution)), system.rows, attribution.noise)


def test_independent_causes_share_by_their_squares():
    found = shared(*system_of(np.eye(2), [2.0, 1.0]))
    assert found == pytest.approx([0.8, 0.2], abs=0.02)


def test_shares_add_up_to_one_in_any_order_of_the_causes():
    mix = [[1.0, 0.0, 0.0], [0.6, 0.8, 0.0], [0.0, 0.3, 1.0]]
    system, attribution = system_of(mix, [1.0, 2.0, -1.0])
    found = shared(system, attribution)
    assert sum(found) == pytest.approx(1)
    turned = SimpleNamespace(causes=attribution.causes[::-1], noise=attribution.noise)
    assert shared(system, turned) == pytest.approx(found[::-1])


def test_twins_share_alike():
    """Either closes nearly all alone: the one that is added first would take it."""
    found = shared(*system_of([[1.0, 0.02], [1.0, -0.02]], [1.0, 1.0]))
    assert found == pytest.approx([0.5, 0.5], abs=0.02)


@pytest.mark.slow
def test_many_causes_are_shared_by_orders_drawn():
    count = 10
    system, attribution = system_of(np.eye(count), np.arange(1.0, count + 1))
    found = shared(system, attribution)
    squares = np.arange(1.0, count + 1) ** 2
    assert found == pytest.approx(squares / squares.sum(), abs=0.01)
    assert found == shared(system, attribution)


def test_one_cause_has_it_all_and_none_has_nothing():
    system, attribution = system_of([[1.0]], [1.0])
    assert shared(system, attribution) == (1.0,)
    assert shared(system, SimpleNamespace(causes=(), noise=attribution.noise)) == ()


def test_a_guess_closes_what_likely_causes_leave_and_takes_nothing_off_them():
    system, attribution = system_of([[1.0, 0.0], [0.8, 0.6]], [1.0, 0.0])
    sure, guess = attribution.causes
    told = SimpleNamespace(causes=(replace(sure, probability=0.9), guess), noise=attribution.noise)
    assert shared(system, told) == pytest.approx([1.0, 0.0], abs=0.01)
    assert shared(system, attribution)[1] > 0.2


def test_where_nothing_is_closed_nothing_is_shared():
    assert shared(*system_of(np.eye(2), [0.0, 0.0], size=1.0)) == ()


def test_what_each_closes_adds_up_to_what_all_close():
    system, attribution = system_of([[1.0, 0.0], [0.6, 0.8]], [1.0, 2.0])
    chosen = [k for cause in attribution.causes for k in cause.columns]
    judged = held_out(system, system.noise_before, attribution.noise, chosen)
    closed = closed_squares(apart(system, attribution))
    assert closed.sum(axis=0) == pytest.approx(judged.before - judged.after)


def of_squares(*squares, observed=1):
    """Groups whose mean squares (g,) no fit changes, those of the reference runs first."""
    of_group = np.array(squares)

    def rms(chosen, noise, fitted, of):
        return np.sqrt(of_group[list(of)].mean(axis=0))

    seen = np.arange(len(of_group)) >= len(of_group) - observed
    noise = np.ones(len(of_group[0]))
    return SimpleNamespace(noise_before=noise, group_observed=seen, of_group=of_group, rms=rms)


def test_runs_that_are_alike_leave_nothing_over_one_another():
    assert spread(of_squares(*[[2.0, 3.0]] * 5), np.ones(2), slice(None)) == pytest.approx(0.0)


def test_the_loudest_half_counts_at_its_worst_joint_and_observed_runs_do_not():
    squares = [[1.0, 1.0], [1.0, 1.0], [1.0, 5.0], [1.0, 5.0], [100.0, 100.0]]
    assert spread(of_squares(*squares), np.ones(2), slice(None)) == pytest.approx(4.0)


def test_below_the_floor_all_are_alike():
    assert spread(of_squares([0.1], [0.2], [0.3], [0.4], [9.0]), np.ones(1), slice(None)) < 0


def test_three_groups_have_no_halves():
    assert spread(of_squares([1.0], [1.0], [1.0], [9.0]), np.ones(1), slice(None)) is None
