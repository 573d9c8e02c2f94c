"""How far a cause repeats: what halves of the time say of it, held against each other."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.isolation.repeating import repeating
from irtwin.gap.regression.hypotheses import Column, Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.accumulate import Block

BLOCKS, ROWS = 16, 40
HALF = np.arange(BLOCKS * ROWS) < BLOCKS * ROWS / 2
FRICTION = catalogue()["viscous_friction"]
RNG = np.random.default_rng(3)
NOISE, COLUMN = RNG.standard_normal((2, BLOCKS * ROWS))


def found(column, measured):
    """How a cause of one column repeats in a run of one joint, beside a twin of one offset."""
    rows = np.column_stack([np.ones(len(column)), column, measured]).reshape(BLOCKS, ROWS, 3)
    blocks = tuple(Block("run", k, k + 1, np.array([ROWS]), (own,)) for k, own in enumerate(rows))
    term = Term("c", "N m", "j", spread=10.0)
    groups, all_observed = np.arange(BLOCKS), np.ones(BLOCKS, dtype=bool)
    system = System(((None, term),), (Column(None, 0, term),), np.ones((1, 2), bool), blocks, groups, all_observed)
    cause = SimpleNamespace(columns=(1,), scope="missing", variants=(Variant(FRICTION, (1,), (term,)),))
    finding = SimpleNamespace(
        system=system,
        causes=(cause,),
        chosen=[1],
        attribution=SimpleNamespace(noise=np.array([1.0]), hypotheses=range(100)),
    )
    return repeating(finding, DEFAULT.selection)[0]


def test_what_acts_all_the_time_repeats():
    once = found(COLUMN, 1 + 2 * COLUMN + NOISE)
    assert once.part > 0.97 and once.p < 0.01 and once.shown == (True, True)


@pytest.mark.parametrize("later", [0.0, -2.0])
def test_what_one_half_says_and_the_other_does_not_bear_out_does_not(later):
    once = found(COLUMN, np.where(HALF, 2.0, later) * COLUMN + NOISE)
    assert once.part == 0.0 and once.p > 0.5
    assert once.shown == (True, later != 0)


def test_less_of_what_is_less_later_repeats():
    assert 0.0 < found(COLUMN, np.where(HALF, 2.0, 1.2) * COLUMN + NOISE).part < 0.8


def test_a_half_that_does_not_excite_a_cause_says_nothing_of_it():
    once = np.where(np.arange(len(COLUMN)) < BLOCKS * ROWS / 4, COLUMN, 0.0)
    assert found(once, 2 * once + NOISE) is None


def test_a_number_of_the_twin_that_is_another_later_is_no_contradiction():
    assert found(COLUMN, np.where(HALF, 5.0, -5.0) + 2 * COLUMN + NOISE).part > 0.9


def test_the_best_of_many_by_chance_seldom_repeats():
    """The size of the p-value where residuals wander: of 100 columns, the one that noise goes with most."""
    rng, passed = np.random.default_rng(0), 0
    for _ in range(30):
        wander = np.repeat(rng.standard_normal((101, BLOCKS * 2)), ROWS // 2, axis=1)
        column = max(wander[1:], key=lambda one: abs(one @ wander[0]))
        passed += found(column, wander[0]).p <= 0.1
    assert passed <= 6
