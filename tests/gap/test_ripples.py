"""Which ripples are tried: known orders where a joint moves through a period, and fast ones that are found."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.synthetic import arm, swing

from irtwin.gap.screening.remainder import RunResidual
from irtwin.gap.screening.ripples import fast_ripples, known_ripples

ROBOT = arm(3)


def remainders(order, size, joint=1, observed=True):
    """Six runs of noise of 1 N m, with a ripple on one joint."""
    generator, left = np.random.default_rng(2), []
    for run in range(6):
        motion = swing(ROBOT, run, seconds=8, rate=125)
        residual = generator.standard_normal(motion.q.shape)
        residual[:, joint] += size * np.sin(order * motion.q[:, joint] + 0.4)
        residual[:100] = np.nan
        left.append(RunResidual(motion, residual, observed))
    return left


@settings(max_examples=20)
@given(st.floats(26.0, 399.0))
def test_the_order_is_found_as_finely_as_the_joint_turns_far(order):
    (found,) = (one for one in fast_ripples(ROBOT, remainders(order, 0.7)) if one.joints == ("joint_2",))
    assert abs(found.N - order) <= 0.5


def test_what_is_found_is_faster_than_the_orders_that_are_all_tried():
    assert all(one.screened for one in fast_ripples(ROBOT, remainders(12.0, 0.7)))


def test_runs_that_are_not_observed_say_nothing():
    assert fast_ripples(ROBOT, remainders(60.0, 0.7, observed=False)) == []
    assert known_ripples(ROBOT, remainders(60.0, 0.0, observed=False)) == []


def test_a_joint_that_stands_still_has_none():
    left = remainders(60.0, 0.0)
    for one in left:
        one.motion.q[:, 1] = 0.3
        one.residual[:, 1] = 1.0
    assert ("joint_2",) not in [one.joints for one in fast_ripples(ROBOT, left)]


def test_a_known_order_is_tried_at_the_joints_that_move_through_a_period_of_it():
    left = remainders(60.0, 0.0)
    for one in left:
        one.motion.q[:, 0] = np.linspace(-np.pi, np.pi, len(one.motion.q))
        one.motion.q[:, 1] = 0.3
        one.motion.q[:, 2] = np.linspace(0, 2 * np.pi / 2.5, len(one.motion.q))
    left.append(RunResidual(swing(ROBOT, 9), np.zeros((1, 3)), observed=False))
    joints = {one.N: one.joints for one in known_ripples(ROBOT, left)}
    assert joints[1.0] == joints[2.0] == ("joint_1",)
    assert joints[3.0] == joints[24.0] == ("joint_1", "joint_3")
