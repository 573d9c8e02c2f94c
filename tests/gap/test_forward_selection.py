"""Which causes are found, in systems whose columns and coefficients are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import Term
from irtwin.gap.isolation.cause import between_groups
from irtwin.gap.isolation.forward_selection import attribute
from irtwin.gap.regression.cross_validation import canonical_correlation
from irtwin.gap.regression.hypotheses import MISSING, Column, Hypothesis, Variant
from irtwin.gap.regression.moments import Moments
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.accumulate import Block, triangle

ROWS, RUNS = 300, 12
EFFECT = catalogue()["cable_drag"]


def system_of(mix, coefficients, size=10.0, silent=(), sparse=1):
    """Columns that are mixtures (rows of `mix`) of independent ones, and what `coefficients` of these add up to.

    In `silent` runs the first `sparse` of the independent ones are zero.
    """
    generator = np.random.default_rng(1)
    blocks = []
    for run in range(RUNS):
        independent = np.linalg.qr(generator.standard_normal((ROWS, len(coefficients))))[0] * np.sqrt(ROWS)
        independent[:, :sparse] *= run not in silent
        columns = size * independent @ np.array(mix).T
        measured = size * independent @ coefficients + generator.standard_normal(ROWS)
        factor = triangle(np.column_stack([np.ones((ROWS, 1)), columns, measured]))
        blocks.append(Block(f"run_{run}", 0.0, 1.0, np.array([ROWS]), (factor,)))
    columns = tuple(Column(EFFECT, k, Term(f"k{k}", "1")) for k in range(len(mix)))
    pattern = np.ones((1, 1 + len(mix)), dtype=bool)
    terms = ((EFFECT, Term("constant", "1")),)
    system = System(terms, columns, pattern, tuple(blocks), np.arange(RUNS), np.ones(RUNS, dtype=bool))
    candidates = [
        Hypothesis(f"effect_{k}", None, MISSING, (Variant(EFFECT, (1 + k,), (column.term,)),))
        for k, column in enumerate(columns)
    ]
    return system, candidates


def found(mix, coefficients):
    return [cause.effect for cause in attribute(*system_of(mix, coefficients), seed=0, limits=DEFAULT).causes]


def on_two_joints(coefficients):
    """Two equations, each with a column of its own, and what the coefficients of these add to it."""
    generator = np.random.default_rng(1)
    blocks = []
    for run in range(RUNS):
        columns = 10 * generator.standard_normal((ROWS, 2))
        measured = columns * coefficients + generator.standard_normal((ROWS, 2))
        both = [triangle(np.column_stack([columns[:, k], measured[:, k]])) for k in range(2)]
        blocks.append(Block(f"run_{run}", 0.0, 1.0, np.array([ROWS, ROWS]), tuple(both)))
    columns = tuple(Column(EFFECT, k, Term(f"k{k}", "1")) for k in range(2))
    groups, observed = np.arange(RUNS), np.ones(RUNS, dtype=bool)
    system = System((), columns, np.eye(2, dtype=bool), tuple(blocks), groups, observed)
    candidates = [
        Hypothesis(f"effect_{k}", f"joint_{k}", MISSING, (Variant(EFFECT, (k,), (column.term,)),))
        for k, column in enumerate(columns)
    ]
    return [cause.effect for cause in attribute(system, candidates, seed=0, limits=DEFAULT).causes]


def test_a_small_cause_is_held_against_a_large_one_where_both_act():
    assert found(np.eye(2), [3.0, 0.1]) == ["effect_0"]  # it may make up for the form of the large one
    assert on_two_joints([3.0, 0.1]) == ["effect_0", "effect_1"]


def test_what_is_there_is_found_and_nothing_else():
    assert found(np.eye(4), [0.0, 0.3, 0.0, 0.1]) == ["effect_1", "effect_3"]
    assert found(np.eye(4), np.zeros(4)) == []


@pytest.mark.slow
def test_what_two_runs_alone_show_is_found_where_it_leads_by_far_and_is_rare():
    def causes(coefficient, speaking, effect="joint_elasticity"):
        system, candidates = system_of(np.eye(4), [coefficient, 0.0, 0.0, 0.0], silent=range(RUNS - speaking))
        first = replace(candidates[0].variants[0], effect=catalogue()[effect])
        candidates[0] = replace(candidates[0], variants=(first,))
        return [cause.effect for cause in attribute(system, candidates, seed=0, limits=DEFAULT).causes]

    assert causes(1.0, speaking=2) == ["effect_0"]
    assert causes(1.0, speaking=2, effect="stribeck_friction") == []  # a joint that sticks shows as much
    assert causes(0.05, speaking=2) == []
    assert causes(1.0, speaking=1) == []  # no other run tells its coefficient


def test_what_sticks_at_one_joint_does_not_hide_what_is_rare_at_another():
    system, candidates = system_of(np.eye(4), [0.6, 1.0, 0.0, 0.0], silent=range(RUNS - 2), sparse=2)
    for k, effect in enumerate(("backlash", "stribeck_friction")):
        variant = replace(candidates[k].variants[0], effect=catalogue()[effect])
        candidates[k] = replace(candidates[k], effect=effect, joint=f"joint_{k}", variants=(variant,))
    assert [cause.effect for cause in attribute(system, candidates[:2], seed=0, limits=DEFAULT).causes] == ["backlash"]
    candidates[1] = replace(candidates[1], joint="joint_0")
    assert [cause.effect for cause in attribute(system, candidates[:2], seed=0, limits=DEFAULT).causes] == []


def test_what_friction_of_another_form_imitates_has_to_explain_a_part_of_the_floor():
    def causes(effect, floor):
        system, candidates = system_of(np.eye(2), [0.05, 0.0])
        first = replace(candidates[0].variants[0], effect=catalogue()[effect])
        candidates[0] = replace(candidates[0], variants=(first,))
        return [cause.effect for cause in attribute(system, candidates, seed=0, limits=DEFAULT, floor=floor).causes]

    assert causes("time_delay", floor=np.array([1.0])) == []
    assert causes("time_delay", floor=np.array([0.5])) == ["effect_0"]
    assert causes("time_delay", floor=None) == ["effect_0"]
    assert causes("cable_drag", floor=np.array([1.0])) == ["effect_0"]


def test_an_effect_that_a_joint_has_shown_may_be_smaller_at_another():
    system, candidates = system_of(np.eye(3), [0.3, 0.025, 0.0])
    assert [cause.effect for cause in attribute(system, candidates, seed=0, limits=DEFAULT).causes] == ["effect_0"]
    alike = [replace(one, effect="effect", joint=f"joint_{k}") for k, one in enumerate(candidates)]
    (cause,) = attribute(system, alike, seed=0, limits=DEFAULT).causes
    assert cause.joints == ("joint_0", "joint_1")


def test_a_mixture_that_comes_first_gives_way_to_the_two_that_it_stands_for():
    mix = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.7, 0.7, 0.08]]
    assert sorted(found(mix, [0.3, 0.2, 0.0])) == ["effect_0", "effect_1"]


def test_effects_that_cannot_be_told_apart_are_rivals_whose_columns_agree():
    system, candidates = system_of([[1.0, 0.0], [1.0, 1e-3]], [0.3, 0.0])
    (cause,) = attribute(system, candidates, seed=0, limits=DEFAULT).causes
    rival = "effect_1" if cause.effect == "effect_0" else "effect_0"
    assert cause.rivals == (rival,)
    assert cause.rival_correlations[rival] == pytest.approx(1.0, abs=1e-3)


def test_of_equals_that_is_not_taken_whose_place_screening_chose():
    system, candidates = system_of([[1.0, 0.0], [1.0, 0.02]], [0.3, 0.0])
    placed = replace(candidates[0].variants[0], effect=catalogue()["local_wear"])
    (cause,) = attribute(system, [replace(candidates[0], variants=(placed,)), candidates[1]], 0, DEFAULT).causes
    assert (cause.effect, cause.rivals) == ("effect_1", ("effect_0",))


def test_effects_that_share_nothing_do_not_correlate():
    system, candidates = system_of(np.eye(2), [0.3, 0.0])
    (cause,) = attribute(system, candidates, seed=0, limits=DEFAULT).causes
    assert cause.rivals == ()
    assert cause.rival_correlations["effect_1"] < 0.05


class Given(Moments):
    """Products that are all there."""

    def __init__(self, products: np.ndarray):
        self.products, self.size = products, len(products)

    def among(self, rows, columns):
        return self.products[np.ix_(rows, columns)]

    def blocks(self, columns):
        return self.products[columns[:, :, None], columns[:, None, :]]


@pytest.mark.slow
@given(st.floats(-0.99, 0.99))
def test_the_canonical_correlation_of_two_columns_is_their_correlation(correlation):
    products = 1e6 * np.array([[1.0, 0, 0, 0], [0, 1, correlation, 0], [0, correlation, 1, 0], [0, 0, 0, 1]])
    system, _ = system_of(np.eye(2), [0.0, 0.0])
    same, other = canonical_correlation(system, Given(products), (), [(1,), (2,)])
    assert same == pytest.approx(1, abs=1e-5)
    assert other == pytest.approx(abs(correlation), abs=1e-3)


def test_uneven_gains_in_every_group_are_sure_and_mixed_ones_are_not():
    uneven = np.array([2.75, 0.27, 0.05, 0.08, 0.08, 0.12, 0.44, 1.04, 0.13])
    everywhere = np.ones(9)
    assert between_groups(uneven, everywhere, DEFAULT.selection) > 3
    assert between_groups(uneven * np.array([1, -1, 1, -1, 1, -1, -1, -1, 1]), everywhere, DEFAULT.selection) < 1
    assert between_groups(np.array([1.0]), np.array([1.0]), DEFAULT.selection) == 0


def test_groups_that_an_effect_says_nothing_of_do_not_count():
    gain = np.array([0.9, -0.01, 0.8, 0.0, -0.02, 1.1, -0.01])
    assert between_groups(gain, np.ones(7), DEFAULT.selection) < 2.3
    assert between_groups(gain, np.abs(gain), DEFAULT.selection) > 10
    assert (
        between_groups(gain[[0, 1, 3]], np.abs(gain[[0, 1, 3]]), DEFAULT.selection) < 2.3
    )  # of one that speaks nothing can be said


@pytest.mark.slow
@given(arrays(float, 6, elements=st.integers(-50, 50), unique=True), st.floats(0.1, 10))
def test_the_unit_of_gain_does_not_matter(gain, unit):
    said = np.arange(1.0, 7.0)
    assert between_groups(unit * gain, said, DEFAULT.selection) == pytest.approx(
        between_groups(gain, unit * said, DEFAULT.selection), rel=1e-6, abs=1e-6
    )


def test_products_and_scores_are_those_of_the_factors():
    system, _ = system_of(np.eye(3), np.array([1.0, -2.0, 0.5]))
    term = Term("constant", "1", expected=2.0, spread=3.0)
    system = replace(system, terms=((EFFECT, term),), observed=np.arange(RUNS) >= RUNS // 2)
    weights = np.arange(1.0, 9.0)  # of the constant, three columns, what of these changed, and the measurement
    for run, moments in enumerate(system.moments(np.array([0.5]))):
        factor, used = system.factor(run, 0)
        places = np.append(used, 7)
        expected = np.zeros((8, 8))
        expected[np.ix_(places, places)] = factor.T @ factor / 0.25
        np.testing.assert_allclose(moments.whole, expected, rtol=1e-9, atol=1e-6)
        left, products = system.scored(run, 0, weights)
        np.testing.assert_allclose(left, factor @ weights[places], rtol=1e-9, atol=1e-9)
        np.testing.assert_allclose(products[places], factor.T @ left, rtol=1e-9, atol=1e-6)
        assert not np.delete(products, places).any()
