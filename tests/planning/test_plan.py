"""A plan leads from pose to pose within all limits and touches nothing; what cannot be is told in one line."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache

import numpy as np
import pinocchio as pin
import pyarrow.parquet as pq
import pytest
from tests.data_sets import irtwin, irtwin_does, irtwin_refuses
from tests.planning.boxes import arm, folded, twin_of

from irtwin.errors import InputError
from irtwin.planning.plan import Plan, Task, any_order, nominal_twin, plan
from irtwin.planning.poses import Pose, read_target
from irtwin.planning.programme import Section, SectionedMotion
from irtwin.planning.timing import MotionLimits
from irtwin.robot.collision import CollisionModel, Obstacle
from irtwin.robot.kinematics import placements
from irtwin.signals.motion import Motion
from irtwin.twin.files import load, to_json

pytestmark = pytest.mark.slow

SIX = arm(6)
START, GOAL = np.array([-0.9, 1.0, 0.6, 0.0, 0.5, 0.0]), np.array([0.9, 1.0, 0.6, 0.0, 0.5, 0.0])
BOX = Obstacle((0.104, -0.132, 0.408), (0.1, 0.1, 0.1))
WALL = Obstacle((0.6, 0.0, 0.4), (0.5, 0.1, 0.8))


@cache
def around_the_wall() -> Plan:
    return plan(nominal_twin(SIX), Task(START, GOAL, [WALL]))


def test_a_plan_goes_around_a_box():
    straight = np.array([START, GOAL])
    model = CollisionModel(SIX, [WALL])
    assert model.first_meeting(np.array([0.0, 1.0]), straight)[0] is not None
    made = around_the_wall()
    assert model.first_meeting(made.motion.time, made.motion.q)[0] is None
    assert made.clearance > 0
    np.testing.assert_allclose(made.motion.q[[0, -1]], straight, atol=1e-9)
    assert made.price is None


def assert_rests_and_limits(made: Motion) -> None:
    """Of speed and acceleration."""
    limits = MotionLimits.of(SIX)
    for state, limit in ((made.dq, limits.speed), (made.ddq, limits.acceleration)):
        assert np.abs(state[[0, -1]]).max() < 1e-9
        assert (np.abs(state) <= limit).all()


def test_a_plan_starts_and_ends_at_rest_and_keeps_all_limits():
    made, limits = around_the_wall().motion, MotionLimits.of(SIX)
    assert_rests_and_limits(made)
    jerk = np.diff(made.ddq, axis=0) * made.rate
    assert (np.abs(jerk) <= limits.jerk).all()
    assert np.allclose(np.diff(made.q, axis=0) * made.rate, (made.dq[1:] + made.dq[:-1]) / 2, atol=1e-2)


def test_torque_limits_bind():
    """Weak joints make the same way slower, and none takes more than it has."""
    lift = Task(START, np.array([0.9, -1.0, -0.6, 0.0, 0.5, 0.0]))
    strong = plan(nominal_twin(SIX), lift)
    weak = arm(6, effort=60.0)
    made = plan(nominal_twin(weak), lift)
    assert made.seconds > strong.seconds
    assert np.abs(nominal_twin(weak).joint_torque(made.motion)).max() <= 60.0


def along_a_line() -> Task:
    """A move of the flange by 5, 20 and -10 cm, without a turn."""
    start = np.array([0.0, 0.6, 1.2, 0.0, 0.7, 0.0])
    place = pin.SE3(placements(SIX, start[None])[0])
    goal = place.translation + np.array([0.05, 0.2, -0.1])
    return Task(start, Pose(tuple(goal), tuple(pin.rpy.matrixToRpy(place.rotation))), line=True)


def way_along_the_line(made: Plan, goal: np.ndarray) -> np.ndarray:
    """How far the flange has come, m, which never leaves its line to the goal."""
    places = placements(SIX, made.motion.q)[:, :3, 3]
    gone, along = places - places[0], (goal - places[0]) / np.linalg.norm(goal - places[0])
    assert np.linalg.norm(gone - np.outer(gone @ along, along), axis=1).max() < 1e-4
    np.testing.assert_allclose(places[-1], goal, atol=1e-5)
    return gone @ along


def test_the_flange_goes_along_a_line():
    task = along_a_line()
    assert way_along_the_line(plan(nominal_twin(SIX), task), np.array(task.goal.place))[-1] > 0.2


@pytest.mark.parametrize(
    ("task", "message"),
    [
        (Task(START, folded(SIX)), "the goal is in collision: link_1 touches link_3"),
        (Task(START, GOAL, [BOX]), "the start is in collision: link_2 touches"),
        (Task(START, np.array([3.0, 0, 0, 0, 0, 0])), "the goal: joint_1 at 3 rad is outside its limits"),
        (Task(START, Pose((2.3, 0, 0.3), (0, 0, 0))), "is out of reach: the flange stays 1[0-9]{3} mm"),
        (Task(START, START), "start and goal are the same pose"),
        (Task(START, GOAL, seconds=0.1), "cannot be done in 0.1 s; the fastest on this way takes"),
        (Task(START, GOAL, least_energy=True), "least energy needs a twin that has seen power"),
        (Task(START, GOAL, payload_mass=900.0), "of the torque limit of joint"),
    ],
)
def test_what_cannot_be_is_told(task, message):
    with pytest.raises(InputError, match=message):
        plan(nominal_twin(SIX), task)


def test_a_goal_in_a_cage_is_not_found():
    """Walls all about the arm, which starts outside of the one it is to reach beyond."""
    walls = [Obstacle((0.0, side * 0.25, 0.6), (3.0, 0.02, 1.2)) for side in (-1, 1)]
    walls.append(Obstacle((0.0, 0.0, 1.22), (3.0, 3.0, 0.02)))
    with pytest.raises(InputError, match=r"in collision|found no path in 0.5 s that touches nothing"):
        plan(nominal_twin(SIX), Task(START, GOAL, walls, search=0.5))


@pytest.mark.parametrize("text", ["", "1,2", "1,2,3,4,5,nan", "pose:1,2,3", "pose:1,2,3,4,5,x", "1 2 3 4 5 6"])
def test_a_pose_that_is_none_is_refused(text):
    with pytest.raises(InputError, match=r"--to .*: give 6 joint positions"):
        read_target(text, 6, "--to")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    place = tmp_path_factory.mktemp("plan")
    robot = arm(3)
    (place / "twin.json").write_text(to_json(twin_of(robot)))
    (place / "no_power.json").write_text(to_json(twin_of(robot, power=False)))
    (place / "bare.urdf").write_text(arm(3, shapes=False).urdf)
    return place


ENDS = ("--from", "-0.9,0.5,0.6", "--to", "0.9,1.0,-0.6")


@pytest.mark.parametrize("ending", ["csv", "parquet"])
def test_a_plan_is_a_log_that_predict_prices_alike(folder, ending):
    out, predicted = folder / f"plan.{ending}", folder / "predicted.parquet"
    planned = irtwin_does("plan", folder / "twin.json", *ENDS, "--seconds", "2", "--out", out)
    assert "2.000 s" in planned.out and "mm least clearance; energy" in planned.out
    priced = irtwin_does("predict", folder / "twin.json", out, "--out", predicted)
    found = [float(said.split("energy ")[1].split(" ")[0]) for said in (planned.out, priced.out)]
    assert found[0] == pytest.approx(found[1], rel=0.01)
    assert "95 % interval" in priced.out
    assert pq.read_table(predicted).column_names[-1] == "power"


def test_least_energy_costs_no_more_than_the_slowed_motion(folder):
    twin = load(folder / "twin.json")
    task = Task(np.array([-0.9, 0.5, 0.6]), np.array([0.9, 1.0, -0.6]), seconds=1.5)
    slowed, least = plan(twin, task), plan(twin, replace(task, least_energy=True))
    assert least.seconds == slowed.seconds
    assert least.price.energy.value < slowed.price.energy.value
    assert least.clearance > 0
    assert (np.abs(least.motion.dq) <= 3.0).all()


@pytest.mark.nightly
def test_least_energy_along_a_line_changes_its_timing_alone():
    twin, task = twin_of(SIX), replace(along_a_line(), seconds=1.0)
    slowed, least = plan(twin, task), plan(twin, replace(task, least_energy=True))
    assert least.price.energy.value < 0.999 * slowed.price.energy.value
    assert least.seconds == pytest.approx(slowed.seconds)
    assert (np.diff(way_along_the_line(least, np.array(task.goal.place))) > -1e-9).all()
    assert_rests_and_limits(least.motion)


def test_what_is_not_known_is_not_shown(folder):
    said = irtwin("plan", folder / "no_power.json", *ENDS, "--out", folder / "p.csv")
    assert "energy and power are not known" in said.out
    said = irtwin_does("plan", folder / "bare.urdf", *ENDS, "--out", folder / "p.csv")
    assert "no collision shapes, so it was not checked whether the robot meets itself" in said.err


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--from", "0,0", "--to", "0,0,0"], '--from "0,0": give 3 joint positions'),
        ([*ENDS, "--box", "1", "1", "1", "0", "1", "1"], "a box of 0 1 1 m is no obstacle"),
        ([*ENDS, "--seconds", "nan"], "not a finite number"),
        ([*ENDS, "--out", "none.txt"], "a motion is written as .csv, .parquet, .script or .src"),
    ],
)
def test_bad_options_are_told(folder, options, message):
    said = irtwin_refuses("plan", folder / "twin.json", "--out", folder / "none.csv", *options)
    assert message in said.err
    assert not (folder / "none.csv").exists()


@pytest.mark.parametrize(
    ("positions", "message"),
    [
        (lambda time: time / 3 * [0.1, 0.1, 2.9], "joint_3 is at .* outside its limits"),
        (lambda time: time / 3 * folded(arm(3)), "s link_1 meets link_3"),
        (lambda time: 0.5 * np.sin(9 * time) * np.ones(3), "moves at .* above its limit of 3 rad/s"),
    ],
    ids=["too far", "folded", "too fast"],
)
def test_a_motion_that_cannot_be_is_refused_with_its_time(folder, tmp_path, positions, message):
    time = np.linspace(0, 3, 301)
    q = positions(time[:, None])
    rows = ["time,q_joint_1,q_joint_2,q_joint_3", *(",".join(map(str, row)) for row in np.column_stack([time, q]))]
    (tmp_path / "motion.csv").write_text("\n".join(rows))
    said = irtwin_refuses("predict", folder / "twin.json", tmp_path / "motion.csv", "--out", tmp_path / "out.parquet")
    assert "motion.csv: at " in said.err
    assert re.search(message, said.err), said.err
    assert not (tmp_path / "out.parquet").exists()


def test_a_plan_for_another_robot_is_refused(folder, tmp_path):
    irtwin("plan", folder / "twin.json", *ENDS, "--out", tmp_path / "plan.csv")
    text = (tmp_path / "plan.csv").read_text()
    (tmp_path / "plan.csv").write_text(text.replace("joint_3", "elbow"))
    said = irtwin_refuses("predict", folder / "twin.json", tmp_path / "plan.csv", "--out", tmp_path / "o.parquet")
    assert "plan.csv: column q_elbow: the robot has no moving joint" in said.err


def test_poses_between_are_visited_in_the_order_that_takes_least() -> None:
    far, near, middle = (np.array([turn, 1.0, 0.6, 0.0, 0.5, 0.0]) for turn in (0.7, -0.7, 0.1))
    made = plan(nominal_twin(SIX), Task(START, GOAL, via=(far, near, middle)))
    assert made.tour.order == (2, 3, 1) and made.tour.saved is None
    assert made.tour.sooner > 0.3
    for pose in (near, middle, far):
        row = int(np.argmin(np.abs(made.motion.q - pose).max(axis=1)))
        assert np.abs(made.motion.q[row] - pose).max() < 0.01 and np.abs(made.motion.dq[row]).max() < 0.2
    assert np.ptp(np.diff(made.motion.time)) < 1e-9
    with pytest.raises(InputError, match=r"a duration is that of one move; give none, and time the whole by"):
        plan(nominal_twin(SIX), Task(START, GOAL, via=(near,), seconds=3.0))


def test_a_programme_pauses_at_its_places_in_the_order_that_takes_least(folder) -> None:
    far, near = (np.array([turn, 1.0, 0.6]) for turn in (0.7, -0.7))
    start, goal = np.array([-0.9, 1.0, 0.6]), np.array([0.9, 1.0, 0.6])
    q = np.repeat([start, far, near, start, goal], 2, axis=0)
    kinds = ("pause", "move") * 4 + ("pause",)
    sections = tuple(Section(row, row + 1, kind) for row, kind in enumerate(kinds))
    known = load(folder / "twin.json")
    programme = SectionedMotion(Motion(np.arange(10.0), q, 0 * q, 0 * q, run="weld"), sections)
    tour = any_order(known, programme)
    assert tour.order in ((3, 2, 1), (2, 3, 1)) and tour.saved.value > 0
    assert any_order(known, replace(programme, sections=sections[:5])) is None
    best = [0, *(2 * place for place in tour.order), 8]
    ordered = replace(programme.motion, q=np.repeat(q[::2][[row // 2 for row in best]], 2, axis=0))
    assert any_order(known, replace(programme, motion=ordered)) is None


def test_pauses_one_after_another_at_one_pose_are_one_place(folder) -> None:
    start, far, near, goal = (np.array([turn, 1.0, 0.6]) for turn in (-0.9, 0.7, -0.7, 0.9))
    q = np.repeat([start, start, far, far, near, goal], 2, axis=0)
    sections = tuple(Section(row, row + 1, "pause" if row % 2 == 0 else "move") for row in range(11))
    programme = SectionedMotion(Motion(np.arange(12.0), q, 0 * q, 0 * q, run="weld"), sections)
    assert any_order(load(folder / "twin.json"), programme).order == (2, 1)


def test_places_that_are_one_pose_are_a_line_where_no_order_parts_them() -> None:
    near = np.array([-0.7, 1.0, 0.6, 0.0, 0.5, 0.0])
    with pytest.raises(InputError, match="start and goal are the same pose"):
        plan(nominal_twin(SIX), Task(START, GOAL, via=(near, near)))
