"""What goes with the scale of torque, and how sure it is then."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from irtwin.effects.effect import Quantity
from irtwin.twin.torque_scale import FittedTorqueScale, torque_degree


@pytest.mark.parametrize(
    ("unit", "degree"),
    [
        ("N m", 1), ("N", 1), ("kg", 1), ("kg m^2", 1), ("N m s/(rad K)", 1), ("N m/rad", 1), ("W/(N m)^2", -2),
        ("W/(N m)", -1), ("rad", 0), ("1", 0), ("W", 0), ("ohm", 0), ("K", 0), ("W s/rad", 0), ("s", 0), ("m", 0),
    ],
)  # fmt: skip
def test_what_goes_with_torque(unit, degree):
    assert torque_degree(unit) == degree


@given(st.floats(-100, 100), st.floats(0.01, 10), st.floats(0.5, 1.0), st.floats(1.0, 2.0))
def test_a_wider_interval_holds_the_narrow_one_and_the_scaled_value(value, half, low, high):
    said = FittedTorqueScale(0.1, "assumed", low, high, "")
    wide = said.widened(Quantity("m", None, value, "kg", value - half, value + half))
    assert wide.lower <= min(value - half, low * value, high * value) + 1e-9
    assert wide.upper >= max(value + half, low * value, high * value) - 1e-9
    angle = Quantity("e", None, value, "rad", value - half, value + half)
    assert said.widened(angle) == angle


@pytest.mark.parametrize("unit, uncertainty, lower", [("rad", 0.1, 1.9), ("N m", 0.0, 1.9), ("N m", 0.1, None)])
def test_what_has_no_second_interval(unit, uncertainty, lower):
    assert FittedTorqueScale(uncertainty, "assumed", 0.9, 1.1, "").interval(2.0, unit, lower, 2.1) is None


def test_noise_and_scale_are_added_in_quadrature():
    lower, upper = FittedTorqueScale(0.1, "assumed", 0.9, 1.1, "").interval(10.0, "N m", 9.0, 11.0)
    assert (10 - lower, upper - 10) == (pytest.approx(2**0.5), pytest.approx(2**0.5))
