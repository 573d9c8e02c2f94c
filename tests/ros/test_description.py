"""A robot under names that ROS takes, with what URDF parsers insist on."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
from tests.virtual.scene_data import kr6

from irtwin.robot.description import Robot
from irtwin.robot.kinematics import link_placements
from irtwin.robot.urdf import parse_urdf
from irtwin.ros.description import described

ODD = """<robot name="Zelle 1/b">
<link name="Fuß"/>
<link name="arm 1"><inertial><mass value="2"/></inertial>
  <visual><geometry><mesh filename="package://cell/arm.stl"/></geometry></visual></link>
<link name="arm-1"><collision><geometry><mesh filename="meshes/hand.stl"/></geometry></collision></link>
<link name="jaw"/>
<joint name="Achse 1" type="revolute"><parent link="Fuß"/><child link="arm 1"/><origin xyz="0 0 1"/>
  <axis xyz="0 0 1"/></joint>
<joint name="Achse_1" type="prismatic"><parent link="arm 1"/><child link="arm-1"/><axis xyz="1 0 0"/></joint>
<joint name="jaw turn" type="revolute"><parent link="arm-1"/><child link="jaw"/><mimic joint="Achse 1"/>
  <limit lower="0" upper="1" velocity="1" effort="1"/></joint>
</robot>"""


def check_same(robot: Robot, other: Robot) -> None:
    """Check that links, in their order, are in one place."""
    for q in np.random.default_rng(1).uniform(-2.0, 2.0, (5, len(robot.joints))):
        places = zip(link_placements(robot, q).values(), link_placements(other, q).values(), strict=True)
        assert all(np.abs(one - two).max() < 1e-12 for one, two in places)


def test_a_robot_whose_names_are_valid_is_written_as_it_is() -> None:
    robot = kr6()
    made = described(robot)
    assert made.robot.joints == robot.joints
    assert (made.robot.name, made.said) == (robot.name, ())
    check_same(robot, made.robot)


def test_odd_names_are_made_valid_and_told() -> None:
    robot = parse_urdf(ODD)
    made = described(robot)
    assert made.robot.name == "Zelle_1_b"
    assert made.robot.joint_names == ("Achse_1_2", "Achse_1")
    assert [link.name for link in made.robot.links] == ["Fu", "arm_1", "arm_1_2", "jaw"]
    check_same(robot, made.robot)
    assert made.said[:3] == (
        'robot "Zelle 1/b" is Zelle_1_b in ROS',
        'joint "Achse 1" is Achse_1_2 in ROS',
        'link "Fuß" is Fu in ROS',
    )


def test_what_ros_asks_for_is_filled_in_and_told() -> None:
    made = described(parse_urdf(ODD))
    root = ElementTree.fromstring(made.robot.urdf)
    kinds = {joint.get("name"): joint.get("type") for joint in root.iter("joint")}
    assert kinds == {"Achse_1_2": "continuous", "Achse_1": "prismatic", "jaw turn": "fixed"}
    limit = root.find("joint[@name='Achse_1']/limit")
    assert (limit.get("lower"), limit.get("upper")) == ("-1000.0", "1000.0")
    assert set(root.find("link[@name='arm_1']/inertial/inertia").attrib.values()) == {"0.0"}
    assert made.said[-6:] == (
        "joint Achse 1 has no limits: it is continuous in ROS",
        "joint Achse_1 has no limits: its URDF says 1000 m either way",
        "joint jaw turn mimics another: it is fixed in ROS",
        "its meshes are of the ROS package cell, which has to be installed",
        "ROS finds no mesh by the path meshes/hand.stl; name it as package://NAME/meshes/hand.stl",
        "collision meshes are not opened: of their links only adjacent ones are said to need no check",
    )
