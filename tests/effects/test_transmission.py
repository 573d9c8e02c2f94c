"""Shapes that a change has alone."""

from __future__ import annotations

import numpy as np
from tests.synthetic import arm, swing

from irtwin.effects.transmission import JointCoupling

ROBOT = arm(3)
MOTION = swing(ROBOT, 1, seconds=5.0)


def test_a_coupling_that_changes_brings_each_joints_own_rotor_and_viscous_friction() -> None:
    standing = JointCoupling()
    (change,) = standing.changes()
    own = change.columns(ROBOT, MOTION) - standing.columns(ROBOT, MOTION)
    np.testing.assert_allclose(own[:, -2:, 0], MOTION.ddq[:, -2:])
    np.testing.assert_allclose(own[:, -2:, 1], MOTION.dq[:, -2:])
    assert not own[..., 2].any()
    assert not own[:, :-2].any()
    assert change.standing() == standing
