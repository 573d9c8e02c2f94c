"""Shapes of effects that are named by id alone, as motions show them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.effect import Effect
from irtwin.effects.friction import StribeckFriction
from irtwin.effects.local import LocalWear
from irtwin.twin.shapes import shaped

ROBOT = arm(3)


def sticking(seed, speed=0.1, exponent=2.0):
    """A motion in which all joints stick by 5 N m more about zero speed."""
    motion = measure(ROBOT, swing(ROBOT, seed), noise=0.1, seed=seed)
    more = 5.0 * np.sign(motion.dq) * np.exp(-((np.abs(motion.dq) / speed) ** exponent))
    return replace(motion, torque=motion.torque + more, power=None)


def of_stribeck(effects):
    return [one for one in effects if isinstance(one, Effect) and one.id == "stribeck_friction"]


@pytest.mark.slow
def test_an_effect_that_is_named_gets_the_shape_that_the_motions_show():
    effects = shaped(ROBOT, [[sticking(1), sticking(2)]], [*BASELINE, "stribeck_friction"])
    assert set(BASELINE) <= set(effects)
    assert all(one.vs == pytest.approx(0.1, rel=0.02) and one.d == 2.0 for one in of_stribeck(effects))


@pytest.mark.slow
def test_a_shape_lies_between_those_that_are_tried_where_motions_say_so():
    side = [sticking(seed, 0.14, 1.4) for seed in (1, 2)]
    effects = of_stribeck(shaped(ROBOT, [side], [*BASELINE, "stribeck_friction"]))
    assert {name for one in effects for name in one.joints} == set(ROBOT.joint_names)
    assert all(one.vs == pytest.approx(0.14, rel=0.1) and one.d == pytest.approx(1.4, rel=0.1) for one in effects)


@pytest.mark.slow
def test_sides_of_other_friction_share_the_shape_that_one_of_them_shows():
    never_sticks = replace(measure(ROBOT, swing(ROBOT, 3), noise=0.1, seed=3), power=None)
    found = of_stribeck(shaped(ROBOT, [[never_sticks], [sticking(1)]], [*BASELINE, "stribeck_friction"]))
    assert all(one.vs == pytest.approx(0.1, rel=0.02) and one.d == 2.0 for one in found)


@pytest.mark.slow
@pytest.mark.parametrize("place", [-0.3, 0.04], ids=["between two below zero", "between one below and one above"])
def test_a_number_of_a_shape_may_be_below_zero(place):
    worn = LocalWear(q0=place, w=LocalWear().candidates(ROBOT)[0].w)
    plain = [replace(measure(ROBOT, swing(ROBOT, seed), noise=0.1, seed=seed), power=None) for seed in (1, 2)]
    side = [replace(one, torque=one.torque + 8 * sum(worn.samples(ROBOT, one, None))) for one in plain]
    found = [one for one in shaped(ROBOT, [side], [*BASELINE, "local_wear"]) if isinstance(one, LocalWear)]
    assert {name for one in found for name in one.joints or ROBOT.joint_names} == set(ROBOT.joint_names)
    assert all(one.q0 == pytest.approx(place, abs=0.01) for one in found)


def test_what_is_given_in_a_shape_keeps_it():
    given = [*BASELINE, StribeckFriction(vs=0.02, d=1.0)]
    assert shaped(ROBOT, [[sticking(1)]], given) == tuple(given)


def test_motions_without_torque_leave_shapes_open():
    silent = replace(sticking(1), torque=None, current=None)
    assert shaped(ROBOT, [[silent]], ["stribeck_friction"]) == ("stribeck_friction",)


@pytest.mark.slow
def test_the_shape_of_one_effect_is_chosen_beside_those_of_the_others():
    def curved(seed):
        motion = sticking(seed, speed=0.1)
        return replace(motion, torque=motion.torque + 3.0 * np.sign(motion.dq) * np.abs(motion.dq) ** 3)

    named = [*BASELINE, "nonlinear_viscous_friction", "stribeck_friction"]
    for effects in (named, [*BASELINE, *named[:-3:-1]]):
        found = shaped(ROBOT, [[curved(1), curved(2)]], effects)
        assert all(one.vs == pytest.approx(0.1, rel=0.02) and one.d == 2.0 for one in of_stribeck(found))


@pytest.mark.slow
def test_sides_whose_power_was_measured_share_a_shape_of_power():
    sides = [[measure(ROBOT, swing(ROBOT, seed), noise=0.1, seed=seed)] for seed in (1, 2)]
    found = shaped(ROBOT, sides, [*BASELINE, "meter_lag"])
    assert [one.id for one in found if isinstance(one, Effect)] == ["meter_lag"]
