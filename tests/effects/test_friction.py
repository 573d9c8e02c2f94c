"""Friction whose temperature dependence changed: equal to the former one at a temperature of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.synthetic import arm, swing

from irtwin.effects.effect import Coefficients
from irtwin.effects.friction import ChangedFrictionWithTemperature, StribeckFriction, TemperatureDependentFriction

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
