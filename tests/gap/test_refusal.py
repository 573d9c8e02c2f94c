"""Causes whose numbers cannot be true are refused, and that is said."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, measure, swing

from irtwin.document.document import Refused
from irtwin.effects.catalogue import catalogue
from irtwin.effects.effect import NOTHING_STATED, Possible, Quantity, Stated
from irtwin.gap.data.case import case_of
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.isolation.finding import find
from irtwin.gap.isolation.refusal import Refusals, _beyond, find_possible
from irtwin.gap.search import Search
from irtwin.gap.thresholds import DEFAULT

pytestmark = pytest.mark.usefixtures("no_experiment")

ROBOT = arm(2)


def logged(change):
    """Runs of a healthy arm, and as many whose torque (N, 2) `change` alters, of dq and torque."""
    made = []
    for seed in range(4):
        role = "reference" if seed < 2 else "observed"
        shown = measure(ROBOT, replace(swing(ROBOT, seed, seconds=10.0), run=f"run_{seed}"), noise=0.3, seed=seed)
        torque = shown.torque if role == "reference" else change(shown.dq, shown.torque)
        made.append(replace(as_run(replace(shown, torque=torque, power=None, current=None)), role=role))
    return data_set(ROBOT, made)


def named(diagnosis):
    return {(cause.effect, joint) for cause in diagnosis.document.causes for joint in cause.joints}


@pytest.mark.slow
def test_less_friction_than_none_is_refused_and_nothing_else_explains_it():
    found = diagnose(logged(lambda dq, torque: torque - np.array([14.0, 0.0]) * np.sign(dq)))
    first, *_ = found.document.refused
    assert (first.effect, first.joints) == ("coulomb_friction", ("joint_1",))
    assert first.why.startswith("Fc = -8 N m (")
    assert first.why.endswith("would be left of it; at least 0 is possible")
    assert ("coulomb_friction", "joint_1") not in named(found)
    assert found.verdict == "unexplained"


@pytest.mark.parametrize("unmatched", [True, False])
def test_what_one_look_refused_the_next_does_not_search_again(unmatched):
    one = case_of(logged(lambda dq, torque: torque), (), DEFAULT)
    finding = find("torque", one, Search(one).plain, np.full(2, 0.3))
    refused = Refused(effect="joint_elasticity", joints=("joint_2",), why="too soft")
    before, asked = Refusals((refused,), unmatched), []

    def search(without):
        asked.append(without)
        return finding, Floor(None, None, None)

    *_, refusals = find_possible(one, search, frozenset({"backlash"}), before)
    assert asked == [{"backlash", ("joint_elasticity", "joint_2")}]
    assert refusals == before  # other looks leave more or less for other reasons


@pytest.mark.slow
def test_a_torque_constant_may_be_off_as_far_as_the_data_set_states():
    found = diagnose(replace(logged(lambda dq, torque: torque * [1.0, 1.3]), torque_scale_uncertainty=0.1))
    assert ("torque_constant_error", "joint_2") not in named(found)
    assert any("torque_scale_uncertainty" in one.why for one in found.document.refused)


@pytest.mark.slow
def test_a_sensor_may_come_to_be_off_by_more_than_sensors_are():
    found = diagnose(replace(logged(lambda dq, torque: torque * [1.0, 1.1]), notes={"torque": "joint torque sensor"}))
    assert ("torque_constant_error", "joint_2") in named(found)


def possible(effect, stated=NOTHING_STATED):
    return catalogue()[effect].possible(ROBOT, stated)


def test_a_load_is_bounded_by_what_is_there_and_what_is_rated():
    mass = possible("payload", Stated(payload=2.0, rated_payload=7.0))["m"]
    assert mass.low == pytest.approx(-(4.0 + 2.0))  # of the last body, and told
    assert mass.high == 14.0
    assert "7 kg are rated" in mass.why
    assert possible("payload")["m"].high == 20.0


def test_a_sensor_is_off_by_little_unless_the_data_set_says_more():
    of_sensor = possible("torque_constant_error", Stated(torque_sensor=0.02))["g"]
    assert (of_sensor.low, of_sensor.high) == (0.98, 1.02)
    assert "torque_scale_uncertainty" in of_sensor.why
    assert possible("torque_constant_error", Stated(torque_scale=0.2, torque_sensor=0.02))["g"].high == 1.2


@pytest.mark.parametrize(
    ("effect", "name", "value", "allowed"),
    [
        ("torque_constant_error", "g", 3.0, False),
        ("torque_constant_error", "g", 1.83, True),
        ("payload", "c_x", 3.5, False),
        ("torque_constant_error", "g", 0.8, True),
        ("meter_gain", "g", 0.3, False),
        ("cable_drag", "k", -3.0, False),
        ("base_tilt", "angle", 0.9, False),
        ("encoder_offset", "e", 0.2, True),
        ("load_dependent_friction", "mu_back", -0.9, False),
        ("winding_temperature", "T", 400.0, False),
        ("joint_elasticity", "K", 1e-3, False),
    ],
)
def test_effects_declare_what_can_be(effect, name, value, allowed):
    limits = possible(effect)[name]
    assert (limits.low <= value <= limits.high) == allowed


def test_an_interval_that_reaches_what_is_possible_is_not_refused():
    limits = Possible(0.7, 1.4, "of it")
    assert _beyond(Quantity("g", None, 2.0, "1", 1.3, 2.7), limits) is None
    assert _beyond(Quantity("g", None, 2.0, "1"), limits) is None
    assert (
        _beyond(Quantity("g", None, 2.0, "1", 1.9, 2.1), limits) == "g = 2 (1.9 to 2.1); 0.7 to 1.4 is possible: of it"
    )
    assert "at least 0 is possible" in _beyond(Quantity("k", None, -2.0, "N", -3, -1), Possible(0.0, np.inf, "of it"))
