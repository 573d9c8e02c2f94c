"""Pairs of links that MoveIt need not check, and a pose to start from."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from tests.virtual.scene_data import kr6

from irtwin.robot.collision import CollisionModel
from irtwin.robot.description import Robot
from irtwin.robot.structure import structure_of
from irtwin.robot.urdf import parse_urdf
from irtwin.ros.collision_pairs import free_pairs, home

BALL = '<collision><origin xyz="{0} 0 0"/><geometry><sphere radius="{1}"/></geometry></collision>'
MESH = '<collision><geometry><mesh filename="package://arm/hand.stl"/></geometry></collision>'


def arm(*links: str, lower: float = -3.1, upper: float = 3.1) -> Robot:
    """A chain of links, each 0.5 m along x of the one before, that turns about z."""
    text = "".join(f'<link name="l{number}">{shapes}</link>' for number, shapes in enumerate(links))
    for number in range(1, len(links)):
        text += (
            f'<joint name="j{number}" type="revolute"><parent link="l{number - 1}"/><child link="l{number}"/>'
            f'<origin xyz="0.5 0 0"/><axis xyz="0 0 1"/>'
            f'<limit lower="{lower}" upper="{upper}" velocity="1" effort="1"/></joint>'
        )
    return parse_urdf(f'<robot name="arm">{text}</robot>')


def reasons(robot: Robot) -> dict[tuple[str, str], str]:
    pairs = free_pairs(robot, CollisionModel(robot), structure_of(robot).solids)
    return {(first, second): reason for first, second, reason in pairs}


def test_each_pair_is_told_by_why_it_needs_no_check() -> None:
    small, huge = BALL.format(0.25, 0.1), BALL.format(0, 2.0)
    adjacent = [("l0", "l1"), ("l1", "l2"), ("l2", "l3")]
    assert reasons(arm(*[small] * 4)) == dict.fromkeys(adjacent, "Adjacent")  # at pi the third link lies on the first
    assert reasons(arm(small, small, small, lower=-1.0, upper=1.0))["l0", "l2"] == "Never"
    assert reasons(arm(huge, small, small))["l0", "l2"] == "Always"


def test_of_a_link_with_a_mesh_only_adjacent_ones_are_left_out() -> None:
    ball = BALL.format(0.25, 0.1)
    found = reasons(arm(ball, ball, ball + MESH, lower=-0.5, upper=0.5))
    assert found == {("l0", "l1"): "Adjacent", ("l1", "l2"): "Adjacent"}


def test_of_the_kr6_what_never_meets_is_what_does_not_at_other_poses() -> None:
    robot = kr6()
    model, found = CollisionModel(robot), reasons(robot)
    lower, upper = (np.array([getattr(joint, side) for joint in robot.joints]) for side in ("lower", "upper"))
    met = model.ever_meeting(np.random.default_rng(7).uniform(lower, upper, (2000, 6)))
    never = {frozenset(pair) for pair, reason in found.items() if reason == "Never"}
    assert not never & met
    shaped = model.shaped
    assert met <= {frozenset(pair) for pair in combinations(shaped, 2)} - {frozenset(pair) for pair in found}


def test_home_is_zero_where_zero_is_clear() -> None:
    robot = kr6()
    assert not home(robot, CollisionModel(robot)).any()


def test_home_is_within_the_limits_and_clear() -> None:
    folded = arm(BALL.format(0.25, 0.2), BALL.format(0.25, 0.1), BALL.format(0.25, 0.2), lower=0.5)
    assert home(folded, CollisionModel(folded)).tolist() == [0.5, 0.5]
    tight = arm(BALL.format(0.5, 0.3), BALL.format(0.25, 0.01), BALL.format(-0.4, 0.3))
    model = CollisionModel(tight)
    assert model.touches(np.zeros(2))
    assert not model.touches(home(tight, model))
