"""Two bodies meet where geometry says that they do."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from tests.planning.boxes import arm
from tests.virtual.scene_data import kr6

from irtwin.errors import InputError
from irtwin.robot.collision import STEP, CollisionModel, Obstacle
from irtwin.robot.urdf import parse_urdf

ROBOT = arm(3)


def test_neighbours_are_left_out_and_others_are_not():
    model = CollisionModel(ROBOT)
    assert model.checks_itself
    assert not model.touches(np.zeros(3))
    assert model.clearance(np.zeros(3)) == pytest.approx(0.4, abs=1e-6)  # the link in between is that long
    assert model.meeting(np.array([0.0, 2.7, 2.7])) == ("link_1", "link_3")


def test_pairs_that_always_touch_are_left_out():
    """The third joint lies in the first link's end, and the third link's shape about it."""
    short = ROBOT.urdf.replace('<origin xyz="0 0 0.4"/><axis', '<origin xyz="0 0 0"/><axis')
    short = short.replace('<collision><origin xyz="0 0 0.1"/>', '<collision><origin xyz="0 0 0.05"/>')
    assert not CollisionModel(parse_urdf(short)).checks_itself


def test_a_robot_without_shapes_checks_nothing_and_says_so():
    bare = arm(3, shapes=False)
    model = CollisionModel(bare)
    assert not model.checks_itself
    assert model.unchecked == ("link_1", "link_2", "link_3")
    assert model.clearance(np.zeros(3)) == np.inf
    assert model.first_meeting(np.arange(2.0), np.ones((2, 3))) == (None, np.inf)
    with pytest.raises(InputError, match="no collision shapes, so nothing can be kept off a box"):
        CollisionModel(bare, [Obstacle((1, 0, 0), (1, 1, 1))])


@pytest.mark.parametrize("size", [(0.0, 1.0, 1.0), (1.0, -1.0, 1.0), (1.0, 1.0, float("nan")), (1e9, 1.0, 1.0)])
def test_a_box_of_no_size_is_refused(size):
    with pytest.raises(InputError, match="is no obstacle"):
        Obstacle((0, 0, 0), size)


def test_a_shape_of_no_size_and_too_many_are_refused():
    with pytest.raises(InputError, match=r'collision shape of link "link_1": a cylinder of 0 0\.3 m has no size'):
        CollisionModel(parse_urdf(ROBOT.urdf.replace('radius="0.04" length="0.3"', 'radius="0" length="0.3"')))
    with pytest.raises(InputError, match="503 collision shapes and boxes cannot be checked; give at most 500"):
        CollisionModel(ROBOT, [Obstacle((5, 0, 0), (1, 1, 1))] * 500)


def test_a_thin_wall_between_two_samples_is_met():
    """The tip goes through a wall of 2 mm in one step of 1.2 rad: time and pair are those of geometry."""
    wall = Obstacle((0.5, 0.0, 0.3), (0.002, 2.0, 0.6))
    model = CollisionModel(ROBOT, [wall])
    time, q = np.array([0.0, 2.0]), np.array([[0.0, 0.0, 0.0], [0.0, 1.57, 0.0]])
    meeting, clearance = model.first_meeting(time, q)
    assert (meeting.first, meeting.second) == ("link_3", "the box")
    assert abs(clearance) < 2 * STEP
    before = q[0] + (q[1] - q[0]) * (meeting.time - 0.01) / 2
    assert not model.touches(before)


def test_no_point_goes_farther_than_is_said():
    random = np.random.default_rng(0)
    model, data = ROBOT.model, ROBOT.model.createData()
    tip = model.getFrameId("flange", pin.FrameType.BODY)
    for start, step in zip(random.uniform(-2, 2, (50, 3)), random.uniform(-0.1, 0.1, (50, 3)), strict=True):
        places = []
        for q in (start, start + step):
            pin.framesForwardKinematics(model, data, q)
            places.append(data.oMf[tip].translation.copy())
        assert np.linalg.norm(places[1] - places[0]) <= CollisionModel(ROBOT).travel(step[None])[0]


def test_the_slope_of_the_clearance_is_that_of_its_differences():
    model, q = CollisionModel(ROBOT), np.array([0.3, 1.2, 1.4])
    value, slope = model.clearance_slope(q)
    assert value == model.clearance(q)
    step = np.array([0.0, 0.0, 1e-3])
    assert model.clearance(q + step) - value == pytest.approx(slope @ step, rel=0.02)


def test_pairs_that_ever_meet_are_those_of_each_pose() -> None:
    robot = kr6()
    model = CollisionModel(robot)
    poses = np.random.default_rng(3).uniform(-2.0, 2.7, (300, 6))
    met = {frozenset(pair) for pair in map(model.meeting, poses) if pair is not None}
    found = model.ever_meeting(poses)
    assert met
    assert met <= found <= model.own_pairs
    assert model.ever_meeting(poses[:0]) == set()
