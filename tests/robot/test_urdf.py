"""Reading robots from URDF text."""

import numpy as np
import pytest

from irtwin.errors import InputError
from irtwin.robot.kinematics import flange, link_placements, placements
from irtwin.robot.urdf import parse_urdf, read_urdf

ARM = """<?xml version="1.0"?>
<robot name="arm">
  <material name="orange"><color rgba="1 0.4 0 1"/></material>
  <link name="base"/>
  <link name="upper"><inertial><mass value="2.5"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial>
    <visual><origin xyz="0 0 0.5"/>
      <geometry><cylinder radius="0.1" length="1"/></geometry><material name="orange"/></visual>
    <visual><geometry><mesh filename="file:///etc/passwd"/></geometry></visual></link>
  <link name="fore">
    <inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
  <link name="tool"/>
  <joint name="shoulder" type="continuous"><parent link="base"/><child link="upper"/><axis xyz="0 0 1"/></joint>
  <joint name="elbow" type="revolute"><parent link="upper"/><child link="fore"/><origin xyz="1 0 0"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="1.5" velocity="3" effort="50"/></joint>
  <joint name="tip" type="fixed"><parent link="fore"/><child link="tool"/><origin xyz="0.5 0 0"/></joint>
</robot>"""


def test_joints_and_links_are_read():
    robot = parse_urdf(ARM)
    assert robot.joint_names == ("shoulder", "elbow")
    assert robot.model.nq == robot.model.nv == 2  # a continuous joint has one position
    elbow = robot.joints[1]
    assert (elbow.lower, elbow.upper, elbow.velocity, elbow.effort) == (-2.0, 1.5, 3.0, 50.0)
    assert np.isinf(robot.joints[0].upper)
    assert robot.joints[0].kind == "continuous"
    assert robot.links[1].mass == 2.5


def test_a_prefix_that_nobody_declared_is_read_over():
    """As in packages of models: <limit drake:acceleration="2.5" .../> without xmlns:drake."""
    text = ARM.replace('<limit lower="-2"', '<limit drake:acceleration="2.5" lower="-2"')
    robot = parse_urdf(text.replace('<link name="tool"/>', '<link name="tool"/><drake:proximity/>'))
    assert robot.joints[1].lower == -2.0


def test_kinematics_of_a_planar_elbow():
    robot = parse_urdf(ARM)
    assert flange(robot) == "tool"
    q = np.array([[0.0, 0.0], [np.pi / 2, 0.0], [0.0, -np.pi / 2]])
    assert np.allclose(placements(robot, q)[:, :3, 3], [[1.5, 0, 0], [0, 1.5, 0], [1, 0, 0.5]], atol=1e-12)
    assert np.allclose(link_placements(robot, q[1])["fore"][:3, 3], [0, 1, 0], atol=1e-12)


FINGERS = ARM.replace(
    "</robot>",
    """<link name="left"><inertial><mass value="0.5"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>
    <joint name="finger" type="prismatic"><parent link="tool"/><child link="left"/><mimic joint="elbow"/></joint>
    </robot>""",
)


def test_a_joint_that_mimics_another_is_held_and_its_mass_stays():
    robot, plain = parse_urdf(FINGERS), parse_urdf(ARM)
    assert robot.held == ("finger",)
    assert robot.joint_names == plain.joint_names
    assert sum(i.mass for i in robot.model.inertias) == pytest.approx(sum(i.mass for i in plain.model.inertias) + 0.5)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("<robot><link name='a'></robot>", "line 1, column"),
        ("<sdf/>", "not <robot>"),
        ('<!DOCTYPE r [<!ENTITY a "b">]><robot name="&a;"/>', "DTD or an entity"),
        ('<!DOCTYPE r SYSTEM "file:///etc/passwd"><robot/>', "DTD or an entity"),
        ("<robot><link name='a'/><link name='a'/></robot>", 'two links are named "a"'),
        ("<robot><link name='a'/></robot>", "no joint moves"),
        ("<robot/>", "has no link"),
        (ARM.replace('link="upper"/><child', 'link="nowhere"/><child'), 'parent link "nowhere" is not defined'),
        (ARM.replace("0 1 0", "0 0 0"), "axis is zero"),
        (ARM.replace("0 1 0", "0 nan 0"), "3 finite numbers"),
        (ARM.replace('"2.5"', '"-2.5"'), "negative mass"),
        (ARM.replace('"2.5"', '"heavy"'), '"heavy" should be 1 finite number'),
        (ARM.replace('lower="-2"', 'lower="2"'), "lies above its upper limit"),
        (ARM.replace('type="continuous"', 'type="floating"'), 'type "floating" cannot be modelled'),
        (ARM.replace('<child link="upper"/>', '<child link="tool"/>'), "child of two joints"),
        (ARM.replace('<parent link="base"/>', '<parent link="fore"/>'), 'around link "(upper|fore)" form a loop'),
        (ARM.replace('name="elbow"', 'name="shoulder"'), "is defined twice"),
        (ARM.replace('<axis xyz="0 0 1"/>', '<mimic joint="wrist"/>'), 'mimics "wrist", which is no other'),
    ],
)
def test_faults_are_named(text, message):
    with pytest.raises(InputError, match=message):
        parse_urdf(text, source="robot.urdf")


def test_an_unreadable_file_is_a_users_mistake(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        read_urdf(tmp_path / "none.urdf")
    (tmp_path / "binary.urdf").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="not UTF-8"):
        read_urdf(tmp_path / "binary.urdf")


def test_many_entities_end_at_once():
    entities = "".join(f'<!ENTITY a{k} "{"&a;" * 10}">' for k in range(10))
    bomb = f'<!DOCTYPE r [<!ENTITY a "{"x" * 1000}">{entities}]><robot name="&a9;"/>'
    with pytest.raises(InputError, match="DTD"):
        parse_urdf(bomb)
