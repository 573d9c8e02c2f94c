"""Joint positions that bring the flange to a pose."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.robot.test_denavit_hartenberg import PANDA

from irtwin import resources
from irtwin.robot.chain_table import deviation, table_of
from irtwin.robot.denavit_hartenberg import ChainTable, Row, from_table
from irtwin.robot.description import Robot
from irtwin.robot.inverse_kinematics import nearest
from irtwin.robot.kinematics import placements
from irtwin.robot.urdf import read_urdf

KR6 = read_urdf(resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf")
ROWS = (
    Row(0.325, 0.0, 0.0, lower=-2.0, upper=2.0),
    Row(0.275, np.pi, 0.0, lower=-2.5, upper=2.5),
    Row(0.0, 0.0, 0.0, kind="prismatic", lower=0.0, upper=0.2),
    Row(0.0, 0.0, 0.0),
)
SCARA = from_table("scara", ChainTable(ROWS))


def pose(robot: Robot, q: list[float]) -> pin.SE3:
    return pin.SE3(placements(robot, np.array([q]))[0])


def found(robot: Robot, q: list[float], start: list[float]) -> tuple[np.ndarray, float, float]:
    return nearest(robot, pose(robot, q), np.array(start), *robot.limits)


@pytest.mark.slow
@settings(max_examples=20)
@given(shares=st.lists(st.floats(0.1, 0.9), min_size=6, max_size=6), off=st.floats(-0.05, 0.05))
def test_a_pose_that_was_reached_is_found_again(shares: list[float], off: float) -> None:
    lower, upper = KR6.limits
    q = lower + np.array(shares) * (upper - lower)
    solution, away, turned = found(KR6, q.tolist(), (q + off).tolist())
    assert max(away, turned) < 1e-6
    assert ((solution >= lower) & (solution <= upper)).all()
    assert placements(KR6, solution[None])[0] == pytest.approx(pose(KR6, q.tolist()).homogeneous, abs=1e-6)


def test_a_scara_has_a_left_and_a_right_arm() -> None:
    q = [0.4, 1.0, 0.15, -0.3]
    for shoulder, elbow in ((0.5, 1.0), (1.3, -1.0)):
        solution, away, turned = found(SCARA, q, [shoulder, elbow, 0.1, 0.0])
        assert (solution[1], solution[2]) == pytest.approx((elbow, 0.15), abs=1e-6)
        assert max(away, turned) < 1e-6


def test_an_arm_of_seven_joints_stays_near_its_start() -> None:
    robot = from_table("Panda", ChainTable(PANDA, "modified"))
    q = [0.1, -0.5, 0.2, -1.8, 0.3, 1.6, 0.4]
    assert found(robot, q, q)[0] == pytest.approx(q, abs=1e-6)


def test_limits_may_lie_beyond_a_half_turn() -> None:
    turns, slides = (Row(0.3, 0, 0, lower=4.0, upper=5.0), Row(0.2, 0, 0, kind="prismatic", lower=7.0, upper=7.5))
    robot = from_table("far", ChainTable((turns, slides)))
    solution, *_ = found(robot, [4.5, 7.2], [0.0, 0.0])  # brought within the limits
    assert solution == pytest.approx([4.5, 7.2], abs=1e-6)
    assert max(deviation(robot, table_of(robot))) < 1e-12


def test_out_of_reach_says_by_how_much() -> None:
    wanted = pose(SCARA, [0.0, 0.0, 0.1, 0.0])
    wanted.translation = np.array([0.7, *wanted.translation[1:]])
    _, away, _ = nearest(SCARA, wanted, np.array([0.0, 0.01, 0.1, 0.0]), *SCARA.limits)
    assert away == pytest.approx(0.1, abs=1e-3)
