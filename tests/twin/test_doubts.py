"""What a twin's runs left open, or deny."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing, with_constants

from irtwin.effects.catalogue import BASELINE
from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf
from irtwin.twin.doubts import doubts
from irtwin.twin.identify import identify

ROBOT = with_constants(arm(2))


def fitted(robot: Robot = ROBOT, effects=(*BASELINE, "copper_loss"), moving=(1.0, 1.0)):
    """A twin of two runs of a robot whose motion is taken so many times in each joint."""
    motions = []
    for seed in (1, 2):
        motion = swing(ROBOT, seed)
        moved = replace(motion, q=motion.q * moving, dq=motion.dq * moving, ddq=motion.ddq * moving)
        motions.append(measure(ROBOT, moved, noise=0.1, seed=seed))
    return identify(robot, motions, effects)


def test_a_twin_that_fits_has_none():
    assert doubts(fitted()) == ()


def test_a_contact_is_said_with_its_run_time_and_joint_and_moves_no_number():
    motions = [measure(ROBOT, swing(ROBOT, seed), noise=0.1, seed=seed) for seed in (1, 2)]
    plain = identify(ROBOT, motions)
    push = 20.0 * ((motions[1].time > 4.0) & (motions[1].time < 5.0))
    pushed = identify(ROBOT, [motions[0], replace(motions[1], torque=motions[1].torque + np.outer(push, [0, 1]))])
    (said,) = doubts(replace(pushed, body_change=None))
    (stretch,) = pushed.odd_stretches
    assert stretch.run == motions[1].run and stretch.joints == ("joint_2",)
    assert stretch.start < 4.2 and stretch.stop > 4.8 and stretch.stop - stretch.start < 2.5
    assert f"{stretch.run} from {stretch.start:.1f} to {stretch.stop:.1f} s (joint_2)" in said
    for one, other in zip(plain.parameters, pushed.parameters, strict=True):
        if one.effect in ("coulomb_friction", "viscous_friction"):
            assert one.lower <= other.value <= one.upper


def test_what_no_consistent_bodies_give_is_said():
    twin = fitted(effects=["rigid_body"])
    assert f"up to {100 * twin.body_change:.2g} % of a joint's (RMS)" in doubts(twin)[0]
    assert doubts(replace(twin, body_change=None)) == ()


def test_a_joint_that_stands_is_said_with_what_cures_it():
    (said,) = doubts(replace(fitted(moving=np.array([1.0, 0.0])), body_change=None))
    assert said.startswith("the runs hardly move joint_2, so") and "irtwin robot excite" in said


@pytest.mark.parametrize(("ohm", "denied"), [(0.6, False), (1.4, False), (500.0, True), (0.1, True)])
def test_a_data_sheet_that_the_runs_deny_is_said(ohm, denied):
    first, second = ROBOT.joints
    said = doubts(fitted(replace(ROBOT, joints=(replace(first, winding_resistance=ohm), second))))
    assert [line.startswith(f"joint_1: the data sheet says R is {ohm:.3g} ohm, the runs 0.") for line in said] == [
        True
    ] * denied


def test_a_robot_without_inertias_is_said():
    bare = parse_urdf(re.sub("<inertial>.*?</inertial>", "", ROBOT.urdf))
    (said,) = doubts(fitted(bare, BASELINE))
    assert "has no inertias" in said and "give <inertial> in the URDF" in said
