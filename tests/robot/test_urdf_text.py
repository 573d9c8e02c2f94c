"""URDF text of a structure describes the robot that it was read from; of a text, single numbers change alone."""

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
from irtwin.robot.urdf_text import urdf_text, with_numbers

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


URDF = """<?xml version='1.0'?>
<!-- ü: more bytes than letters -->
<robot  name='r'>
  <link name="base"/>
  <link name='one'>
     <!-- <inertial> in a comment -->
     <inertial>
        <mass value="2"/> <!-- kg --> <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/>
     </inertial>
  </link>
  <link name = "two" ></link> <link name="three" />
  <joint name="j" type="continuous"><parent link="base"/>
    <child link="one"/> <dynamics  damping="1" note="a > b"/></joint>
  <joint name="k" type="continuous"><parent link="one"/><child link="two"/></joint>
  <joint name="l" type="fixed"><parent link="two"/><child link="three"/></joint>
</robot>
"""


def body() -> pin.Inertia:
    return pin.Inertia(1.2345678901234567, np.array([0.1, -1e-17, 0.3]), np.diag([0.1, 0.2, 0.25]) + 0.01)


def test_nothing_changed_is_the_same_text() -> None:
    assert with_numbers(URDF, {}, {}) == with_numbers(URDF, {"none": body()}, {"j": {}}) == URDF


def test_numbers_come_back() -> None:
    dynamics = {"j": {"friction": 0.1 + 0.2}, "k": {"damping": 1 / 3}}
    text = with_numbers(URDF, dict.fromkeys(("one", "two", "three"), body()), dynamics)
    found = structure_of(parse_urdf(text))
    for link in found.bodies[1:]:
        assert (link.mass, link.com) == (body().mass, tuple(body().lever.tolist()))
        assert link.inertia == tuple(
            float(body().inertia[k, m]) for k, m in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))
        )
    numbers = {one.name: (one.damping, one.friction) for one in found.connections}
    assert numbers == {"j": (1.0, 0.1 + 0.2), "k": (1 / 3, 0.0), "l": (0.0, 0.0)}


def test_all_else_stays() -> None:
    text = with_numbers(URDF, {"two": body()}, {"j": {"damping": 2.0}})
    assert '<dynamics damping="2.0" note="a &gt; b"/>' in text
    before, after = URDF.splitlines(), text.splitlines()
    assert [line for line in before if line not in after] == [before[10], before[12]]


@pytest.mark.parametrize("link", ["base", "one"])
def test_a_link_has_one_body(link: str) -> None:
    text = with_numbers(with_numbers(URDF, {link: body()}, {}), {link: pin.Inertia.Zero()}, {})
    assert text.count("</inertial>") == (1 if link == "one" else 2)
    assert "in a comment" in text
