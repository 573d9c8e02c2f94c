"""What an earlier twin knows, as the prior of a fit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.synthetic import arm

from irtwin.effects.friction import CoulombFriction, ViscousFriction
from irtwin.effects.prior import Prior
from irtwin.effects.stack import Stack

ROBOT = arm(2)
STACK = Stack(ROBOT, [CoulombFriction(), ViscousFriction()])
KEYS = tuple((effect.id, term.joint, term.link, term.name) for effect, term in STACK.torque_terms)
UNITS = tuple(term.unit for _, term in STACK.torque_terms)


def known(covariance, count=4):
    return Prior(KEYS[:count], UNITS[:count], np.arange(1.0, 1 + count), covariance)


@given(st.lists(st.floats(-1, 1), min_size=16, max_size=16))
def test_rows_say_the_covariance_in_units_of_spread(entries):
    root = np.reshape(entries, (4, 4)) + 2 * np.eye(4)
    covariance = root @ root.T
    rows = known(covariance).rows(STACK.torque_terms)
    spread = np.array([term.spread for _, term in STACK.torque_terms])
    assert np.linalg.inv(rows.T @ rows) * np.outer(spread, spread) == pytest.approx(covariance, rel=1e-6, abs=1e-9)


def test_terms_expect_what_is_known_and_others_what_the_catalogue_says():
    informed = Stack(ROBOT, STACK.effects, known(np.eye(2), 2))
    assert [term.expected for _, term in informed.torque_terms] == [1.0, 2.0, 0.0, 0.0]
    rows = informed.prior_rows(informed.torque_terms)
    assert rows[2:, :2] == pytest.approx(0)
    assert rows[2:, 2:] == pytest.approx(np.eye(2))


def test_another_unit_and_an_effect_of_some_runs_are_not_known():
    (effect, term), *_ = STACK.torque_terms
    prior = known(np.eye(4))
    assert prior.informed(effect, replace(term, unit="lbf in")).expected == 0.0
    assert prior.informed(replace(effect, runs=("run_1",)), term).expected == 0.0


def test_without_a_prior_there_are_no_rows():
    assert STACK.prior_rows(STACK.torque_terms) is None
