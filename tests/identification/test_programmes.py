"""Programmes of an arm: within its limits, and of whole motions."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.synthetic import arm, rigid_torque, swing

from irtwin.document.form import to_json
from irtwin.effects.catalogue import catalogue
from irtwin.identification.motion_limits import JointLimits
from irtwin.identification.programmes import programmes

pytestmark = pytest.mark.slow

ROBOT = arm(2)
ASKED = [catalogue()[name] for name in ("payload", "temperature_dependent_friction")]


@pytest.fixture(scope="module")
def motions():
    return [replace(swing(ROBOT, seed, 10.0), run=f"run_{seed}", cutoff=20.0) for seed in range(2)]


@pytest.fixture(scope="module")
def of_joint_2(motions):
    return list(programmes(ROBOT, ["joint_2"], motions, ASKED))


def test_programmes_keep_the_limits_of_the_joints(of_joint_2):
    limits = JointLimits.of(ROBOT)
    assert [one.kind for one in of_joint_2][:2] == ["speed_ladder", "slow_sweep"]
    assert {"exciting_motion", "payload", "warm_up", "without_payload"} <= {one.kind for one in of_joint_2}
    for one in of_joint_2:
        json.dumps(to_json(one.said), allow_nan=False)
        for motion in one.motions:
            assert np.all((motion.q > limits.lower) & (motion.q < limits.upper))
            assert np.all(np.abs(motion.dq) <= limits.speed)
            assert np.all(np.abs(motion.ddq) <= limits.acceleration)
            assert motion.time[-1] <= 130


def test_speeds_and_accelerations_of_a_programme_belong_to_its_positions(of_joint_2):
    for one in of_joint_2:
        for motion in one.motions:
            step = 1 / motion.rate
            slope = np.diff(motion.q, axis=0) / step
            between = (motion.dq[1:] + motion.dq[:-1]) / 2
            largest = np.abs(motion.ddq).max()
            assert np.abs(slope - between).max() <= largest * step + 1e-9


def test_joints_that_are_not_asked_for_stand_still(of_joint_2):
    ladder = of_joint_2[0]
    assert np.ptp(ladder.motions[0].q[:, 0]) == 0
    assert set(ladder.settings.speeds) == {"joint_2"}


def test_joints_are_as_warm_as_the_robot_was_last_unless_they_are_to_be_warmed(motions):
    warm = [replace(one, temperature=np.full(one.q.shape, 20.0 + 10 * k)) for k, one in enumerate(motions)]
    for one in programmes(ROBOT, [], warm, ASKED):
        told = [np.unique(motion.temperature).tolist() for motion in one.motions]
        assert told == ([[25.0], [45.0]] if one.kind == "warm_up" else [[30.0]] * len(one.motions))


def test_drives_that_are_weak_are_asked_for_gentler_moves(motions):
    slow = [replace(one, q=0.01 * one.q, dq=0.01 * one.dq, ddq=0.01 * one.ddq) for one in motions]

    def greatest(robot):
        made = next(one for one in programmes(robot, [], slow) if one.kind == "acceleration_steps")
        (motion,) = made.motions
        return np.abs(rigid_torque(robot, motion)).max(axis=0)

    strong = greatest(ROBOT)
    held = np.abs([pin.computeGeneralizedGravity(ROBOT.model, ROBOT.model.createData(), q) for q in slow[0].q]).max(
        axis=0
    )
    limits = held + 0.6 * (strong - held)
    weak = replace(
        ROBOT,
        joints=tuple(replace(joint, effort=float(most)) for joint, most in zip(ROBOT.joints, limits, strict=True)),
    )
    assert (greatest(weak) <= 1.01 * limits).all()
    assert (strong > limits).any()


def test_speeds_of_sliding_joints_are_in_metres(motions):
    assert "m/s" in next(iter(programmes(arm(2, slides=(1,)), ["joint_2"], motions))).text


@pytest.mark.parametrize(("speed", "rate"), [(1e-5, 100.0), (3.0, 50_000.0)])
def test_a_programme_lasts_minutes_and_has_no_million_samples(motions, speed, rate):
    robot = replace(ROBOT, joints=tuple(replace(joint, velocity=speed) for joint in ROBOT.joints))
    fast = [replace(motion, time=motion.time * motion.rate / rate, cutoff=rate / 5) for motion in motions]
    for one in programmes(robot, [], fast):
        for motion in one.motions:
            assert motion.time[-1] <= 600
            assert len(motion.time) <= 100_000


def test_without_limits_those_that_were_seen_are_kept(motions):
    joints = tuple(replace(joint, lower=-np.inf, upper=np.inf) for joint in ROBOT.joints)
    free = replace(ROBOT, joints=joints)
    reached = np.concatenate([motion.q for motion in motions])
    for one in programmes(free, [], motions):
        for motion in one.motions:
            assert np.all(motion.q <= reached.max(axis=0)) and np.all(motion.q >= reached.min(axis=0))
