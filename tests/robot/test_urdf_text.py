"""URDF text of a structure describes the robot that the structure was read from."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given
from tests.robot.chains import chains
from tests.virtual.scene_data import HOSTILE, bare, kr6

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import link_placements
from irtwin.robot.structure import structure_of
from irtwin.robot.urdf import parse_urdf
from irtwin.robot.urdf_text import urdf_text

EXACT = 1e-12


def again(robot: Robot) -> Robot:
    return parse_urdf(urdf_text(robot.name, structure_of(robot), robot.joints))


def check_same(robot: Robot, other: Robot) -> None:
    assert other.joints == robot.joints
    assert {link.name for link in other.links} == {link.name for link in robot.links}
    for q in np.random.default_rng(1).uniform(-2.0, 2.0, (5, len(robot.joints))):
        places = link_placements(other, q)
        for name, place in link_placements(robot, q).items():
            assert np.abs(places[name] - place).max() < EXACT


@pytest.mark.slow
@given(urdf=chains())
def test_any_chain_comes_back(urdf: str) -> None:
    robot = parse_urdf(urdf)
    check_same(robot, again(robot))


@pytest.mark.parametrize("robot", [kr6(), bare(HOSTILE), bare(kind="prismatic"), bare(kind="continuous")])
def test_a_robot_comes_back_with_its_limits(robot: Robot) -> None:
    check_same(robot, again(robot))


def test_bodies_and_shapes_come_back() -> None:
    robot = kr6()
    other = again(robot)
    assert structure_of(other) == structure_of(robot)
    q = np.linspace(-1.0, 1.0, 6)
    torque = pin.rnea(robot.model, robot.model.createData(), q, q, -q)
    assert pin.rnea(other.model, other.model.createData(), q, q, -q) == pytest.approx(torque, rel=1e-12)
