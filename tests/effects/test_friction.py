"""Friction: what changes with temperature, what is known of a law, and where nobody knows its state."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy
from hypothesis import given
from hypothesis import strategies as st
from tests.synthetic import arm, swing

from irtwin.effects.effect import Coefficients
from irtwin.effects.friction import (
    ChangedFrictionWithTemperature,
    FrictionTurn,
    NonlinearViscousFriction,
    PreslidingHysteresis,
    StribeckFriction,
    TemperatureDependentFriction,
    sharp_sign,
)
from irtwin.effects.stack import Stack
from irtwin.signals.motion import Motion

ROBOT = arm(2)
MOTION = swing(ROBOT, 1, seconds=5.0)
WARM = replace(MOTION, temperature=30 + MOTION.time[:, None] * [2.0, -3.0])
CHANGE = ChangedFrictionWithTemperature(joints=("joint_2",))
FV = 12.0


@given(equal_at=st.floats(-20.0, 80.0))
def test_a_change_may_be_equal_to_the_former_friction_at_any_temperature(equal_at: float) -> None:
    other = FV * np.exp(CHANGE.k * (equal_at - CHANGE.T0))  # viscous friction at T0
    values = np.array([CHANGE.k * other, other - FV])
    thins = FV * WARM.dq[:, 1] * (np.exp(-CHANGE.k * (WARM.temperature[:, 1] - equal_at)) - 1)
    np.testing.assert_allclose(CHANGE.contribution(ROBOT, WARM, values)[:, 1], thins, atol=1e-9 * other)
    assert not CHANGE.contribution(ROBOT, WARM, values)[:, 0].any()
    known = {("viscous_friction", "joint_2", "Fv"): FV}
    said = CHANGE.parameters(ROBOT, Coefficients(values, np.zeros((2, 2)), known))
    assert {one.name: one.value for one in said} == pytest.approx({"k": CHANGE.k, "Fv": other - FV})


def test_without_a_temperature_nothing_is_said() -> None:
    assert not CHANGE.columns(ROBOT, MOTION).any()


def test_in_a_twin_viscous_friction_holds_at_t0() -> None:
    (change,) = TemperatureDependentFriction(joints=("joint_2",)).changes()
    assert change == CHANGE
    assert change.standing() == TemperatureDependentFriction(joints=("joint_2",))


def test_no_stribeck_friction_is_tried_at_speeds_over_which_a_joints_dry_friction_turns() -> None:
    sharp, soft = ROBOT.joints
    robot = replace(ROBOT, joints=(sharp, replace(soft, friction_width=0.015, friction_exponent=2.0)))
    tried = {
        (form.vs, form.joints) for form in StribeckFriction().candidates(robot) if isinstance(form, StribeckFriction)
    }
    slow, fast = ("joint_1",), ("joint_1", "joint_2")
    assert tried == {(0.01, slow), (0.025, slow), (0.05, fast), (0.1, fast), (0.2, fast)}


@given(width=st.floats(3e-3, 0.025), law=st.sampled_from(["tanh", "arctangent", "root"]))
def test_however_dry_friction_turns_a_mixture_of_turns_is_near(width: float, law: str) -> None:
    dq = np.tile(np.linspace(-0.5, 0.5, 2001)[:, None], 2)
    motion = Motion(np.arange(len(dq)) / 100, 0 * dq, dq, 0 * dq, run="sweep")
    own = sharp_sign(dq[:, 0])
    u = dq[:, 0] / width
    wanted = {"tanh": np.tanh(u), "arctangent": np.arctan(u) * 2 / np.pi, "root": u / np.sqrt(1 + u**2)}[law]
    columns = [own, dq[:, 0], -dq[:, 0], *(one[:, 0] for one in FrictionTurn().samples(ROBOT, motion, None))]
    _, left = scipy.optimize.nnls(np.column_stack(columns), wanted)
    assert left < 0.1 * np.linalg.norm(wanted - own)


def test_what_of_a_turn_nobody_states_is_no_more_than_the_joints_dry_friction() -> None:
    terms = FrictionTurn().joint_terms(replace(ROBOT.joints[0], dry_friction=5.0))
    assert {(term.spread, term.lowest) for term in terms} == {(5.0, 0.0)}
    assert len({term.name for term in terms}) == len(terms)


@pytest.mark.parametrize("friction", [StribeckFriction(), NonlinearViscousFriction()])
def test_the_law_over_speed_is_known_to_a_part_of_a_joints_dry_friction(friction) -> None:
    for dry, unnamed in ((None, 0.0), (5.0, 0.1)):
        (term,) = friction.joint_terms(replace(ROBOT.joints[0], dry_friction=dry))
        assert term.unnamed == pytest.approx(unnamed)


def moving(*ways: float, rest: float = 1.0, rate: float = 100.0) -> Motion:
    """Joint 1 moves on by `ways`, rad, at 0.1 rad/s each, and rests between; joint 2 does not move."""
    speeds, still = [], []
    for way in ways:
        count = round(abs(way) / 0.1 * rate)
        speeds += [0.1 * np.sign(way)] * count + [0.0] * round(rest * rate)
        still += [False] * count + [True] * round(rest * rate)
    dq = np.column_stack([speeds, np.zeros(len(speeds))])
    standing = np.column_stack([still, np.ones(len(still), dtype=bool)])
    return Motion(np.arange(len(dq)) / rate, np.cumsum(dq, axis=0) / rate, dq, 0 * dq, run="moves", standing=standing)


def test_friction_that_builds_up_is_undecided_over_the_first_way_from_rest() -> None:
    motion = moving(0.3, -0.3)
    undecided = PreslidingHysteresis().undecided(motion)[:, 0]
    way = 0.06 * 100 / 0.1  # samples
    moved = np.flatnonzero(motion.dq[:, 0])
    assert [undecided[moved[:300]].sum(), undecided[moved[300:]].sum()] == pytest.approx([way, way], abs=2)
    assert undecided[moved[:50]].all() and not undecided[moved[70:300]].any() and undecided[moved[310:340]].all()
    part = Stack(ROBOT, [PreslidingHysteresis()]).undecided(motion.part(200, 500))
    np.testing.assert_array_equal(part[:, 0], undecided[200:500])


def test_a_short_stop_and_a_joint_that_hardly_moves_on_are_modelled() -> None:
    stops = moving(0.3, -0.3, rest=0.1)
    assert not PreslidingHysteresis().undecided(stops)[300:, 0].any()
    assert not PreslidingHysteresis().undecided(moving(0.05, -0.05)).any()


def test_only_joints_that_have_such_friction_are_undecided() -> None:
    motion = moving(0.3, -0.3)
    for joints, some in ((None, True), (("joint_1",), True), (("joint_2",), False)):
        assert Stack(ROBOT, [PreslidingHysteresis(joints=joints)]).undecided(motion)[:, 0].any() == some
