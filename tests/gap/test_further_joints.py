"""Causes at further joints where the twin makes up for them with a number that cannot be."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.isolation.forward_selection import Attribution
from irtwin.gap.isolation.further_joints import at_further_joints
from irtwin.gap.regression.hypotheses import MISSING, Column, Hypothesis, Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.accumulate import Block

VISCOUS, CABLE, COULOMB = (catalogue()[name] for name in ("viscous_friction", "cable_drag", "coulomb_friction"))
BLOCKS, ROWS = 32, 40  # the first half of each in one run, the rest in another
RNG = np.random.default_rng(1)
FAST, SLOW = RNG.uniform(0.6, 1.0, (2, BLOCKS * ROWS // 2)), RNG.uniform(0.05, 1.0, (2, BLOCKS * ROWS // 2))
SPEED = np.concatenate([FAST, SLOW], axis=1) * RNG.choice([-1, 1], (2, BLOCKS * ROWS))  # of joints a and b
PLACE = RNG.uniform(-1, 1, BLOCKS * ROWS)
NOISE = RNG.standard_normal((2, BLOCKS * ROWS))
LATE = np.arange(BLOCKS * ROWS) // ROWS % 16 >= 8  # the last half of each run
MEMORIES = {"viscous_friction": np.full(2, 0.1)}


def found(at_b):
    """The finding of viscous friction at joint a, whose twin has friction |dq|^0.3 as well; `at_b` is b's torque."""
    power = np.sign(SPEED) * np.abs(SPEED) ** 0.3
    own = [np.sign(SPEED[0]), power[0], SPEED[0], 4 * SPEED[0] + NOISE[0]]
    other = [np.sign(SPEED[1]), power[1], SPEED[1], PLACE, at_b + NOISE[1]]
    both = [np.column_stack(each).reshape(BLOCKS, ROWS, -1) for each in (own, other)]
    blocks = tuple(
        Block("exciting" if k < BLOCKS / 2 else "validation", k % 16, k % 16 + 1, np.full(2, ROWS), (one, two))
        for k, (one, two) in enumerate(zip(*both, strict=True))
    )
    twin = [
        (COULOMB, Term(name, "N m", j, spread=10.0, lowest=low))
        for j in "ab"
        for name, low in (("Fc", 0.0), ("k", -np.inf))
    ]
    tried = [(VISCOUS, "a"), (VISCOUS, "b"), (CABLE, "b")]
    columns = tuple(Column(effect, 0, Term("x", "N m", joint, spread=10.0)) for effect, joint in tried)
    pattern = np.array([[1, 1, 0, 0, 1, 0, 0], [0, 0, 1, 1, 0, 1, 1]], dtype=bool)
    system = System(tuple(twin), columns, pattern, blocks, np.arange(BLOCKS) // 4, np.ones(BLOCKS, dtype=bool))
    shapes = [Variant(one.effect, (4 + k,), (one.term,)) for k, one in enumerate(columns)]
    each = tuple(
        Hypothesis(effect.id, joint, MISSING, (shape,)) for (effect, joint), shape in zip(tried, shapes, strict=True)
    )
    cause = Cause("viscous_friction", MISSING, ("a",), (shapes[0],), gain=5.0, t=10.0, p=0.001, p_remembered=0.01)
    told = Attribution((cause,), system.residual_rms((4,), np.ones(2)), each, np.ones(3), np.ones(3))
    return Finding("torque", ("a", "b"), frozenset(), system, told, None, None, None, np.zeros(0))


def joints(finding):
    return at_further_joints(finding, finding.causes, MEMORIES, DEFAULT.selection, seed=0)[0].joints


def friction(viscous, coulomb=0.0):
    return coulomb * np.sign(SPEED[1]) + viscous * SPEED[1]


def test_friction_below_none_stood_for_what_is_missing_at_another_joint():
    shown = found(friction(3.0))
    cause = at_further_joints(shown, shown.causes, MEMORIES, DEFAULT.selection, seed=0)[0]
    assert cause.joints == ("a", "b") and cause.columns == (4, 5)
    assert cause.gain == 5.0 and 0.001 <= cause.p <= 0.02


@pytest.mark.parametrize(
    "at_b",
    [
        pytest.param(friction(3.0, coulomb=3.0), id="the twin's number can be"),
        pytest.param(np.where(LATE, friction(6.0), friction(3.0)), id="halves of the time differ"),
        pytest.param(friction(1.0) + 6 * PLACE, id="something else leads there"),
        pytest.param(0.0 * PLACE, id="nothing is there"),
    ],
)
def test_else_a_cause_stays_where_the_search_found_it(at_b):
    assert joints(found(at_b)) == ("a",)


def test_what_remembers_as_long_as_a_run_shows_nothing():
    shown = found(friction(3.0))
    long = {"viscous_friction": np.full(2, 1e3)}
    assert at_further_joints(shown, shown.causes, long, DEFAULT.selection, seed=0)[0].joints == ("a",)


def test_a_cause_that_may_be_chance_itself_goes_no_further():
    shown = found(friction(3.0))
    unsure = replace(shown.causes[0], p_remembered=0.05)
    (cause,) = at_further_joints(shown, [unsure], MEMORIES, DEFAULT.selection, seed=0)
    assert cause == unsure


def test_causes_of_power_are_left_alone():
    shown = replace(found(friction(3.0)), name="power")
    assert joints(shown) == ("a",)
