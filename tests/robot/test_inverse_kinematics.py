"""Joint positions that bring the flange to a pose."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.robot.test_denavit_hartenberg import PANDA, UR10

from irtwin import resources
from irtwin.errors import InputError
from irtwin.robot.chain_table import deviation, table_of
from irtwin.robot.denavit_hartenberg import ChainTable, Row, from_table
from irtwin.robot.description import Robot
from irtwin.robot.inverse_kinematics import solve
from irtwin.robot.kinematics import placements
from irtwin.robot.urdf import read_urdf

KR6 = read_urdf(resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf")
SCARA = from_table(
    "scara",
    ChainTable(
        (
            Row(0.325, 0.0, 0.0, lower=-2.0, upper=2.0),
            Row(0.275, np.pi, 0.0, lower=-2.5, upper=2.5),
            Row(0.0, 0.0, 0.0, kind="prismatic", lower=0.0, upper=0.2),
            Row(0.0, 0.0, 0.0),
        )
    ),
)


def pose(robot: Robot, q: list[float]) -> np.ndarray:
    return placements(robot, np.array([q]))[0]


def apart(one: np.ndarray, other: np.ndarray) -> float:
    return float(np.abs(np.mod(one - other + np.pi, 2 * np.pi) - np.pi).max())


@pytest.mark.slow
@settings(max_examples=5)
@given(shares=st.lists(st.floats(0.02, 0.98), min_size=6, max_size=6))
def test_a_pose_that_was_reached_is_found_again(shares):
    lower, upper = (np.array([getattr(joint, side) for joint in KR6.joints]) for side in ("lower", "upper"))
    q = lower + np.array(shares) * (upper - lower)
    found = solve(KR6, pose(KR6, q), start=q)
    assert len(found.solutions) >= 1
    assert ((found.solutions >= lower) & (found.solutions <= upper)).all()
    for each in placements(KR6, found.solutions):
        assert np.abs(each - pose(KR6, q)).max() < 1e-8
    assert np.abs(pose(KR6, found.solutions[0]) - pose(KR6, q)).max() < 1e-8
    assert apart(found.solutions[0], q) < 1e-3


def test_all_solutions_of_an_arm_with_eight_are_found():
    robot = from_table("UR10", ChainTable(UR10))
    q = np.array([0.3, -1.2, 1.4, 0.4, 1.1, -0.5])
    found = solve(robot, pose(robot, q))
    assert len(found.solutions) == 8
    assert min(apart(each, q) for each in found.solutions) < 1e-6
    assert not found.redundant


@pytest.mark.slow
def test_solutions_are_within_the_limits_and_the_turn_is_the_nearest():
    start = np.array([0.2, -1.4, 1.5, 0.3, 0.8, 5.5])
    found = solve(KR6, pose(KR6, start), start=start)
    assert found.solutions[0] == pytest.approx(start, abs=1e-6)
    assert solve(KR6, pose(KR6, start)).solutions[:, 5] == pytest.approx(
        [q - 2 * np.pi * round(q / (2 * np.pi)) for q in solve(KR6, pose(KR6, start)).solutions[:, 5]]
    )


def test_a_scara_has_a_left_and_a_right_arm():
    q = [0.4, 1.0, 0.15, -0.3]
    found = solve(SCARA, pose(SCARA, q))
    assert sorted(round(each[1], 6) for each in found.solutions) == [-1.0, 1.0]
    assert found.solutions[:, 2] == pytest.approx([0.15, 0.15])
    tilted = pose(SCARA, q)
    tilted[:3, :3] = tilted[:3, :3] @ pin.rpy.rpyToMatrix(0.2, 0.0, 0.0)
    missed = solve(SCARA, tilted)
    assert len(missed.solutions) == 0
    assert (missed.distance, missed.angle) == pytest.approx((0.0, 0.2), abs=1e-6)


def test_an_arm_of_seven_joints_has_solutions_without_end():
    robot = from_table("Panda", ChainTable(PANDA, "modified"))
    q = [0.1, -0.5, 0.2, -1.8, 0.3, 1.6, 0.4]
    found = solve(robot, pose(robot, q), start=np.array(q))
    assert found.redundant
    assert len(found.solutions) > 10
    assert found.solutions[0] == pytest.approx(q, abs=1e-6)


def test_limits_may_lie_beyond_a_half_turn():
    far = ChainTable(
        (Row(0.3, 0.0, 0.0, lower=4.0, upper=5.0), Row(0.2, 0.0, 0.0, kind="prismatic", lower=7.0, upper=7.5))
    )
    robot = from_table("far", far)
    found = solve(robot, pose(robot, [4.5, 7.2]))
    assert found.solutions == pytest.approx(np.array([[4.5, 7.2]]), abs=1e-6)
    assert max(deviation(robot, table_of(robot))) < 1e-12


@pytest.mark.slow
@pytest.mark.parametrize(("x", "distance"), [(0.6, 0.0), (0.7, 0.1), (2.0, 1.4)])
def test_out_of_reach_says_by_how_much(x, distance):
    wanted = pose(SCARA, [0.0, 0.0, 0.1, 0.0])
    wanted[0, 3] = x
    found = solve(SCARA, wanted)
    assert found.distance == pytest.approx(distance, abs=1e-6)
    assert (len(found.solutions) == 0) == (distance > 0)
    assert np.isnan(found.angle) == (distance > 0)


@pytest.mark.parametrize(
    ("start", "link", "message"),
    [
        (np.zeros(5), None, "has 6 moving joints, and the start gives 5 positions"),
        (np.full(6, 1.0), None, "the start has joint_a2 at 1 rad, outside its limits -3.31613 to 0.785398"),
        (None, "hand", 'has no link "hand"'),
    ],
)
def test_faults_are_named(start, link, message):
    with pytest.raises(InputError, match=message):
        solve(KR6, np.eye(4), start=start, link=link)
