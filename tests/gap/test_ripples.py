"""The order of a fast ripple, found in what the twin leaves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.synthetic import arm, swing

from irtwin.gap.screening.remainder import Remainder
from irtwin.gap.screening.ripples import fast_ripples
from irtwin.gap.thresholds import DEFAULT

ROBOT = arm(3)


def remainders(order, size, joint=1, observed=True):
    """Six runs of noise of 1 N m, with a ripple on one joint."""
    generator, left = np.random.default_rng(2), []
    for run in range(6):
        motion = swing(ROBOT, run, seconds=8, rate=125)
        residual = generator.standard_normal(motion.q.shape)
        residual[:, joint] += size * np.sin(order * motion.q[:, joint] + 0.4)
        residual[:100] = np.nan
        left.append(Remainder(motion, residual, observed, f"run_{run}"))
    return left


@settings(max_examples=20, deadline=None)
@given(st.floats(26.0, 399.0))
def test_the_order_is_found_as_finely_as_the_joint_turns_far(order):
    (found,) = fast_ripples(ROBOT, remainders(order, 0.7), DEFAULT.ripples.least_share)
    assert found.joints == ("joint_2",)
    assert abs(found.N - order) <= 0.5


@pytest.mark.parametrize(("order", "size"), [(60.0, 0.0), (60.0, 0.15), (12.0, 0.7)], ids=["none", "small", "slow"])
def test_noise_small_and_slow_ripples_give_no_order(order, size):
    assert fast_ripples(ROBOT, remainders(order, size), DEFAULT.ripples.least_share) == []


def test_runs_that_are_not_observed_say_nothing():
    assert fast_ripples(ROBOT, remainders(60.0, 0.7, observed=False), DEFAULT.ripples.least_share) == []


def test_a_joint_that_stands_still_has_none():
    left = remainders(60.0, 0.0)
    for one in left:
        one.motion.q[:, 1] = 0.3
        one.residual[:, 1] = 1.0
    assert fast_ripples(ROBOT, left, DEFAULT.ripples.least_share) == []
