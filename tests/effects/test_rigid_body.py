"""The bodies' torque and its slope: one joint, and bodies without mass."""

from __future__ import annotations

import gc
from dataclasses import replace
from weakref import ref

import numpy as np
import pinocchio as pin
import pytest
from tests.synthetic import arm, rigid_torque, swing

from irtwin.effects import rigid_body
from irtwin.effects.load import Payload
from irtwin.effects.rigid_body import RigidBody, last_body_columns, model_of, torque_slope
from irtwin.robot.body_regressor import body_regressor
from irtwin.robot.model import inverse_dynamics


@pytest.mark.parametrize("joints", [1, 2, 3])
def test_torque_has_a_column_for_each_joint(joints):
    robot = arm(joints)
    motion = swing(robot, 0, seconds=0.5)
    data, states = robot.model.createData(), zip(motion.q, motion.dq, motion.ddq, strict=True)
    expected = [pin.rnea(robot.model, data, *state) for state in states]
    np.testing.assert_allclose(rigid_torque(robot, motion), expected, atol=1e-12)
    assert last_body_columns(robot, motion).shape == (*motion.q.shape, 10)
    assert Payload().columns(robot, motion).shape[:2] == motion.q.shape


@pytest.mark.parametrize("size", [0.0, 1e-9, 1.0])
def test_the_slope_of_torque_is_right_for_bodies_without_mass_too(size):
    robot = arm(4)
    bodies = size * np.random.default_rng(1).standard_normal(40)
    bodies[::10] = size * np.array([-1.0, 1.0, -2.0, 2.0])  # beyond each joint none, or less
    motion = swing(robot, 0, seconds=0.1)
    model, step = model_of(robot, bodies), 1e-6
    differences = [
        inverse_dynamics(model, motion.q + step * one, motion.dq, motion.ddq)
        - inverse_dynamics(model, motion.q - step * one, motion.dq, motion.ddq)
        for one in np.eye(4)
    ]
    expected = np.stack(differences, axis=2) / (2 * step)
    np.testing.assert_allclose(torque_slope(robot, bodies, motion), expected, atol=1e-6 * max(size, 1e-3))


def test_the_slope_of_an_ordinary_arm_needs_no_ballast():
    robot = arm(3)
    motion = swing(robot, 0, seconds=0.1)
    data = robot.model.createData()
    states = zip(motion.q, motion.dq, motion.ddq, strict=True)
    expected = [pin.computeRNEADerivatives(robot.model, data, *state)[0].copy() for state in states]
    np.testing.assert_array_equal(torque_slope(robot, None, motion), expected)


@pytest.mark.parametrize(
    ("weight", "mass", "expected"),
    [(None, 1.0, 4 * (8.0 + 4.0 + 8.0 / 3) / 3), (60.0, 1.0, 80.0), (None, 0.0, 50.0)],
    ids=["four times what bodies weigh in the mean", "the robot weighs more", "nobody says"],
)
def test_a_body_may_be_off_by_what_bodies_of_its_robot_weigh(weight, mass, expected):
    robot = replace(arm(3), weight=weight)
    for inertia in list(robot.model.inertias)[1:]:
        inertia.mass *= mass
    spreads = {term.name: term.spread for term in RigidBody().terms(robot)}
    assert spreads["m"] == pytest.approx(expected)
    assert spreads["mx"] / spreads["m"] == pytest.approx((spreads["Izz"] / spreads["m"]) ** 0.5)


def test_bodies_and_payload_share_a_regressor_that_goes_with_its_motion(monkeypatch):
    asked = []

    def counted(model, q, dq, ddq):
        asked.append(len(q))
        return body_regressor(model, q, dq, ddq)

    monkeypatch.setattr(rigid_body, "body_regressor", counted)
    robot, motion = arm(2), swing(arm(2), 0, seconds=0.2)
    columns = RigidBody().columns(robot, motion)
    np.testing.assert_array_equal(last_body_columns(robot, motion), columns[:, :, 10:])
    assert asked == [len(motion.time)]
    other = replace(motion, q=motion.q + 0.1)  # equal in name and times
    assert not np.array_equal(RigidBody().columns(robot, other), columns)
    kept = ref(columns)
    del columns, motion, other
    RigidBody().columns(robot, swing(robot, 1, seconds=0.1))
    gc.collect()
    assert kept() is None
