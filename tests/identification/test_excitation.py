import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.identification.arms import kr6, two_joints
from tests.planning.boxes import arm as boxed_arm
from tests.synthetic import arm

from irtwin.errors import InputError
from irtwin.identification import excitation
from irtwin.identification.base_condition import BaseRegressor, determinant
from irtwin.identification.excitation import Excitation, excite
from irtwin.identification.motion_limits import CLEARANCE, FULL_SPEED_AFTER, Box
from irtwin.modelling import write_motion
from irtwin.robot.collision import CollisionModel
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import link_placements
from irtwin.robot.model import inverse_dynamics
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.motion import Motion

pytestmark = pytest.mark.slow

KR6 = kr6()
TWO = two_joints()


def scaled_condition_number(robot: Robot, q: np.ndarray, dq: np.ndarray, ddq: np.ndarray) -> float:
    """The same number by another way: base columns by elimination from the left, singular values by numpy."""
    n, data = len(robot.joints), robot.model.createData()
    rows = []
    for sample in zip(q, dq, ddq, strict=True):
        rigid = pin.computeJointTorqueRegressor(robot.model, data, *sample).copy()
        each = [np.diag(sample[2]), np.diag(sample[1]), np.diag(np.sign(sample[1])), np.eye(n)]
        rows.append(np.hstack([rigid, *each]))
    matrix = np.vstack(rows)
    matrix = matrix[:, np.linalg.norm(matrix, axis=0) > 1e-9]
    matrix /= np.linalg.norm(matrix, axis=0)
    kept: list[int] = []
    for column in range(matrix.shape[1]):
        values = np.linalg.svd(matrix[:, [*kept, column]], compute_uv=False)
        if values[-1] > 1e-7:
            kept.append(column)
    singular = np.linalg.svd(matrix[:, kept], compute_uv=False)
    return float(singular[0] / singular[-1])


def assert_limits_kept(robot: Robot, found: Excitation) -> None:
    """On a grid a hundred times finer than the one that the search saw."""
    fine = np.linspace(0, found.series.period, 100 * len(found.series.grid()))
    q, dq, ddq = found.series.motion(fine)
    for column, joint in enumerate(robot.joints):
        assert joint.lower < q[:, column].min()
        assert q[:, column].max() < joint.upper
        assert np.abs(dq[:, column]).max() < joint.velocity
        assert np.abs(ddq[:, column]).max() < joint.velocity / FULL_SPEED_AFTER


def test_the_kr6_is_excited_well_below_a_condition_number_of_a_hundred() -> None:
    found = excite(KR6, 20.0, iterations=50)
    _, q, dq, ddq = found.sample(20)
    assert scaled_condition_number(KR6, q, dq, ddq) < 15
    assert found.condition_number < 15
    assert_limits_kept(KR6, found)


def test_its_condition_number_is_what_another_way_finds() -> None:
    found = excite(TWO, 5.0, iterations=20, rate=50)
    _, q, dq, ddq = found.sample()
    # the other way may choose other columns of the same space: a factor, not the digits
    assert scaled_condition_number(TWO, q, dq, ddq) == pytest.approx(found.condition_number, rel=0.5)


@settings(max_examples=5)
@given(st.integers(0, 10_000), st.floats(1.0, 45.0))
def test_limits_hold_between_the_samples_for_any_seed(seed: int, seconds: float) -> None:
    found = excite(TWO, seconds, seed=seed, iterations=10)
    assert_limits_kept(TWO, found)
    assert 0 < found.limit_margin < 1
    assert found.clearance > 0
    _, _, dq, ddq = found.sample()
    assert not dq[[0, -1]].any()
    assert not ddq[[0, -1]].any()


def test_links_stay_above_the_floor_and_the_flange_in_its_box() -> None:
    box = Box((0.25, -0.35, 0.3), (0.75, 0.35, 0.9))
    found = excite(KR6, 10.0, box=box, iterations=40)
    q = found.series.motion(np.linspace(0, 10, 4000))[0]
    places = [link_placements(KR6, sample) for sample in q]
    flange = np.array([place["link_joint_a6"][:3, 3] for place in places])
    assert (flange > box.lower).all()
    assert (flange < box.upper).all()
    lowest = min(place[name][2, 3] for place in places for name in place if name != "base")
    assert lowest > CLEARANCE
    sides = np.minimum(flange - box.lower, np.array(box.upper) - flange).min()
    assert found.clearance <= min(sides, lowest - CLEARANCE)


def test_a_box_smaller_than_any_random_posture_hits_is_still_found() -> None:
    found = excite(KR6, 10.0, box=Box((0.5, 0.0, 0.5), (0.55, 0.05, 0.55)), iterations=5)
    assert found.clearance > 0


def test_more_iterations_do_not_harm() -> None:
    few, many = (excite(TWO, 10.0, iterations=count) for count in (5, 60))
    assert many.condition_number <= few.condition_number * 1.02


def test_equal_seeds_give_equal_motions_and_other_seeds_others() -> None:
    first, again, other = (excite(TWO, 4.0, seed=seed, iterations=10) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first.series.sine, again.series.sine)
    assert not np.allclose(first.series.sine, other.series.sine)


def test_a_given_acceleration_limit_is_kept() -> None:
    slow = replace(TWO, joints=tuple(replace(joint, acceleration=0.4) for joint in TWO.joints))
    found = excite(slow, 6.0, iterations=20)
    ddq = found.series.motion(np.linspace(0, 6, 30_000))[2]
    assert 0.3 < np.abs(ddq).max() < 0.4


def test_a_continuous_joint_needs_no_position_limit() -> None:
    found = excite(two_joints('<limit velocity="3" effort="9"/>', "continuous"), 6.0, iterations=5)
    assert np.isfinite(found.condition_number)


def test_a_sliding_joint_is_excited_too() -> None:
    slide = two_joints('<limit lower="-0.3" upper="0.4" velocity="1" effort="90"/>', "prismatic")
    found = excite(slide, 6.0, iterations=10)
    assert_limits_kept(slide, found)
    assert found.condition_number < 100


def test_progress_tells_iteration_best_condition_number_and_time() -> None:
    told: list[tuple[int, float, float]] = []
    excite(TWO, 5.0, iterations=20, progress=lambda *state: told.append(state))
    iterations, conditions, times = zip(*told, strict=True)
    assert list(iterations) == list(range(len(told)))
    assert list(conditions) == sorted(conditions, reverse=True)
    assert list(times) == sorted(times)


def test_ctrl_c_gives_the_best_motion_so_far() -> None:
    told: list[float] = []

    def interrupt(iteration: int, condition: float, elapsed: float) -> None:
        told.append(condition)
        if iteration == 15:
            raise KeyboardInterrupt

    found = excite(TWO, 5.0, progress=interrupt)
    assert found.interrupted
    assert len(told) == 16
    assert found.condition_number == pytest.approx(told[-1], rel=0.1)  # at other samples
    assert_limits_kept(TWO, found)


def test_the_most_work_ends_the_search(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(excitation, "_MOST_WORK", 1e5)  # as if TWO had fifteen joints
    found = excite(TWO, 5.0, iterations=5)
    assert found.bounded
    assert_limits_kept(TWO, found)
    assert not found.interrupted
    monkeypatch.undo()
    assert not excite(TWO, 5.0, iterations=5).bounded


def test_a_time_limit_ends_the_search() -> None:
    told: list[int] = []
    found = excite(TWO, 5.0, time_limit=0.0, progress=lambda iteration, *_: told.append(iteration))
    assert told == [0]
    assert not found.interrupted
    assert_limits_kept(TWO, found)


def test_the_csv_says_what_the_motion_is(tmp_path: Path) -> None:
    found = excite(TWO, 3.0, iterations=5, rate=80)
    path = tmp_path / "motion.csv"
    write_motion(Motion(*found.sample(), run="motion"), TWO, path)
    with path.open(encoding="utf-8") as file:
        header, *rows = csv.reader(file)
    assert header == ["time", "q_turn", "q_lift", "dq_turn", "dq_lift", "ddq_turn", "ddq_lift"]
    values = np.array(rows, dtype=float)
    np.testing.assert_allclose(values, np.column_stack(found.sample()), rtol=1e-9, atol=1e-12)
    assert values.shape == (241, 7)
    assert (values[0, 0], values[-1, 0]) == (0.0, 3.0)
    assert [entry.name for entry in tmp_path.iterdir()] == ["motion.csv"]


def with_first(**changes: object) -> Robot:
    first, *rest = TWO.joints
    return replace(TWO, joints=(replace(first, **changes), *rest))  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("robot", "message"),
    [
        (with_first(lower=-np.inf), 'joint "turn" has no position limits'),
        (with_first(lower=0.0, upper=0.0), 'joint "turn" cannot move'),
        (with_first(lower=1.0, upper=-1.0), 'joint "turn" cannot move'),
        (with_first(velocity=np.inf), 'joint "turn" has no speed limit'),
        (with_first(acceleration=-1.0), 'joint "turn" has the acceleration limit -1'),
        (replace(TWO, joints=()), "no joint moves"),
    ],
)
def test_missing_or_contradictory_limits_are_told(robot: Robot, message: str) -> None:
    with pytest.raises(InputError, match=message):
        excite(robot, 5.0)


@pytest.mark.parametrize(
    ("seconds", "rate", "message"),
    [
        *((seconds, 100.0, r"give 0\.5 to 3600 s") for seconds in (0.0, -1.0, float("nan"), float("inf"))),
        (5.0, 0.0, "give 1 to 10000 Hz"),
        (3600.0, 10_000.0, "are 36000000 samples of 2 joints; ask for at most 3125000"),
    ],
)
def test_time_and_rate_of_a_motion_must_be_sensible(seconds: float, rate: float, message: str) -> None:
    with pytest.raises(InputError, match=message):
        excite(TWO, seconds, rate=rate)


@pytest.mark.parametrize(
    ("box", "message"),
    [
        (Box((5, 0, 0), (6, 1, 1)), "give a larger box"),
        (Box((0.3, 0.0, 0.5), (0.3005, 0.2, 0.6)), "give a larger box"),
        (Box((1, 0, 0), (0, 1, 1)), "every lower bound must be below its upper bound"),
        (Box((float("nan"), 0, 0), (1, 1, 1)), "every lower bound must be below its upper bound"),
    ],
)
def test_a_box_out_of_reach_is_told(box: Box, message: str) -> None:
    with pytest.raises(InputError, match=message):
        excite(TWO, 5.0, box=box)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("joints", [1, 2, 3])
@pytest.mark.parametrize("slides", [(), (0, 1, 2)])
def test_small_robots_are_excited(joints: int, slides: tuple[int, ...]) -> None:
    robot = arm(joints, slides[:joints])
    found = excite(robot, 5.0, iterations=5)
    assert np.isfinite(found.condition_number)
    assert found.clearance > 0
    assert_limits_kept(robot, found)


@pytest.mark.parametrize(
    ("limit", "message"),
    [
        ('lower="-2" upper="2" velocity="1e300"', "has a speed limit of 1e+300, which is not plausible; correct its <"),
        ('lower="-2" upper="2" velocity="1e-300"', "has a speed limit of 1e-300"),
        ('lower="-1e300" upper="1e300" velocity="3"', "has a range of 2e+300"),
        ('lower="0" upper="1e-9" velocity="3"', "has a range of 1e-09"),
    ],
)
def test_limits_that_no_machine_has_are_refused(limit: str, message: str) -> None:
    with pytest.raises(InputError, match=re.escape(f'two: joint "turn" {message}')):
        excite(two_joints(f'<limit {limit} effort="9"/>'), 5.0)


@pytest.mark.filterwarnings("error")
def test_a_robot_that_reaches_to_the_stars_is_refused() -> None:
    with pytest.raises(InputError, match="reaches inf m, which is not plausible; correct the origins"):
        excite(parse_urdf(TWO.urdf.replace("0.2 0 0", "1e300 0 0")), 5.0)


@pytest.mark.nightly
def test_fast_joints_of_a_long_range_are_slowed_until_the_way_is_clear() -> None:
    found = excite(two_joints('<limit lower="-2000" upper="2000" velocity="5000" effort="9"/>'), 5.0, iterations=1)
    assert found.clearance > 0


def test_without_a_box_only_the_floor_is_blamed() -> None:
    low = parse_urdf(TWO.urdf.replace("0 0 0.5", "0 0 -3"))
    with pytest.raises(InputError, match="with every link above the floor, z = 0 of the base frame; raise the first"):
        excite(low, 5.0)


def test_the_robot_does_not_meet_itself_and_keeps_its_torque():
    robot = boxed_arm(3)
    weak = parse_urdf(robot.urdf.replace('effort="300.0"', 'effort="120"'))
    found = excite(weak, 5.0, iterations=30)
    time, q, dq, ddq = found.sample(1000.0)
    assert CollisionModel(weak).first_meeting(time, q)[0] is None
    assert np.abs(inverse_dynamics(weak.model, q, dq, ddq)).max() <= 120


def test_a_robot_that_cannot_be_held_is_refused():
    weak = parse_urdf(boxed_arm(3).urdf.replace('effort="300.0"', 'effort="0.01"'))
    with pytest.raises(InputError, match="holding the arm takes more than the torque limits in every posture"):
        excite(weak, 5.0)


def test_a_criterion_is_better_at_what_it_asks_than_the_condition_number() -> None:
    q, dq, ddq = (values[:20] for values in excite(TWO, 5.0, iterations=5, seed=7).sample(20.0)[1:])
    tasks = [Motion(np.arange(20) / 20.0, q, dq, ddq, run="task")]
    asked = {"condition": {}, "determinant": {"criterion": determinant}, "energy": {"tasks": tasks}}
    found = {name: excite(TWO, 5.0, iterations=60, **one).sample(20.0)[1:] for name, one in asked.items()}
    for name in ("determinant", "energy"):
        rank = BaseRegressor(TWO, **asked[name]).rank
        assert rank(*found[name]) < rank(*found["condition"]) - 0.01
