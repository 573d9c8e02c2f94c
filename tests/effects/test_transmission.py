"""Joints that turn each other: what is felt where, and the shapes that a change has alone."""

from __future__ import annotations

import numpy as np
import pytest
from tests.synthetic import arm, swing

from irtwin.effects.transmission import JointCoupling

ROBOT = arm(3)
MOTION = swing(ROBOT, 1, seconds=5.0)


@pytest.mark.parametrize(("mutual", "felt"), [(True, slice(1, 3)), (False, slice(2, 3))])
def test_a_coupling_that_changes_brings_each_joints_own_rotor_and_viscous_friction(mutual: bool, felt: slice) -> None:
    standing = JointCoupling(mutual=mutual)
    (change,) = (one for one in standing.changes() if one.standing() == standing)
    own = change.columns(ROBOT, MOTION) - standing.columns(ROBOT, MOTION)
    np.testing.assert_allclose(own[:, felt, 0], MOTION.ddq[:, felt])
    np.testing.assert_allclose(own[:, felt, 1], MOTION.dq[:, felt])
    assert not own[..., 2].any()
    assert not own[:, : felt.start].any()


def test_torque_of_motors_shows_the_coupling_at_the_motor_that_both_joints_turn() -> None:
    mutual, alone = (one.columns(ROBOT, MOTION) for one in JointCoupling().candidates())
    np.testing.assert_array_equal(alone[:, 2], mutual[:, 2])
    np.testing.assert_array_equal(alone[:, 2, 1], MOTION.dq[:, 1])
    assert not alone[:, 1].any()
    assert mutual[:, 1].any()
    assert JointCoupling(mutual=False).touched(ROBOT, "joint_3") == ("joint_3",)
