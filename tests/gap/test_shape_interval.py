from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.synthetic import arm

from irtwin.effects.effect import Quantity
from irtwin.effects.friction import PreslidingHysteresis, StribeckFriction
from irtwin.effects.transmission import TorqueRipple
from irtwin.gap.isolation.shape_interval import with_shape

ROBOT = arm(3)
ANGLES = [shape.d for shape in PreslidingHysteresis().candidates(ROBOT)]


def stated(effect, likely, *, shared=False):
    """What is said of the shape of an effect, which the data do not tell from the `likely` ones."""
    quantities = effect.shape_of_joints(ROBOT, **dict.fromkeys(effect.ranges, "1"))
    return with_shape(quantities, ROBOT, effect, likely, shared=shared)


@given(st.floats(*PreslidingHysteresis.ranges["d"]))
def test_the_nearest_of_the_values_tried_stands_for_the_true_one(true):
    nearest = min(ANGLES, key=lambda angle: abs(np.log(angle / true)))
    (angle,) = stated(PreslidingHysteresis(d=nearest, joints=("joint_1",)), [PreslidingHysteresis(d=nearest)])
    assert angle.value == nearest
    assert angle.lower * (1 - 1e-12) <= true <= angle.upper * (1 + 1e-12)


def test_what_the_data_do_not_tell_apart_is_within():
    form = StribeckFriction(vs=0.05, d=2.0, joints=("joint_2",))
    speed, exponent = stated(form, [form, StribeckFriction(vs=0.1, d=2.0)])
    assert (speed.lower, speed.upper) == pytest.approx((np.sqrt(0.025 * 0.05), np.sqrt(0.1 * 0.2)))
    assert (exponent.lower, exponent.upper) == pytest.approx((np.sqrt(2), 2.0))


def test_what_is_said_lies_within_whatever_is_likelier():
    angle, likelier = PreslidingHysteresis(d=0.01, joints=("joint_1",)), PreslidingHysteresis(d=1e-3)
    (said,) = stated(angle, [likelier])
    assert said.lower < 1e-3 and said.upper > 0.01


def test_a_shape_that_joints_share_is_said_once():
    angle = PreslidingHysteresis(d=3e-3)
    assert len(stated(angle, [angle])) == 3
    (shared,) = stated(angle, [angle], shared=True)
    assert (shared.joint, shared.value) == (None, 3e-3)


def test_a_value_that_a_screening_found_has_no_interval():
    fast = TorqueRipple(N=101.3, joints=("joint_1",))
    (order,) = stated(fast, [fast])
    assert (order.lower, order.upper) == (None, None)


def test_other_quantities_stay_as_they_are():
    size = Quantity("Fs", "joint_1", 2.0, "N m", 1.0, 3.0)
    assert with_shape([size], ROBOT, StribeckFriction(), [], shared=False) == [size]
