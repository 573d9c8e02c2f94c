"""Links, joints and shapes as a URDF gives them."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from irtwin.errors import InputError
from irtwin.robot.structure import Solid, structure_of
from irtwin.robot.urdf import parse_urdf

ARM = """<robot name="arm">
<material name="red"><color rgba="1 0 0 0.5"/></material>
<link name="tip"/><link name="base"/>
<link name="body">
  <inertial><origin xyz="0.1 0 0" rpy="0 0 1.5707963267948966"/><mass value="3"/>
    <inertia ixx="0.1" iyy="0.2" izz="0.25" ixy="0" ixz="0" iyz="0"/></inertial>
  <visual><origin xyz="0 0 1"/><geometry><box size="1 2 3"/></geometry><material name="red"/></visual>
  <visual><geometry><mesh filename="package://arm/body.stl" scale="0.001 0.001 0.001"/></geometry></visual>
  <collision><geometry><cylinder radius="0.2" length="0.7"/></geometry></collision>
</link>
<joint name="turn" type="continuous"><parent link="base"/><child link="body"/><origin xyz="0 0 0.5" rpy="0.1 0.2 0.3"/>
  <axis xyz="0 3 4"/></joint>
<joint name="mount" type="fixed"><parent link="body"/><child link="tip"/></joint></robot>"""


def test_links_come_after_the_ones_that_carry_them():
    structure = structure_of(parse_urdf(ARM))
    assert [body.name for body in structure.bodies] == ["base", "body", "tip"]
    turn, mount = structure.connections
    assert (turn.name, turn.kind, turn.parent, turn.child, turn.axis) == (
        "turn", "continuous", "base", "body", pytest.approx((0.0, 0.6, 0.8))
    )  # fmt: skip
    assert (turn.origin.xyz, turn.origin.rpy) == ((0.0, 0.0, 0.5), (0.1, 0.2, 0.3))
    assert (mount.kind, mount.axis) == ("fixed", None)


def test_a_huge_axis_is_a_direction():
    turn, _ = structure_of(parse_urdf(ARM.replace("0 3 4", "0 0 1e300"))).connections
    assert turn.axis == (0.0, 0.0, 1.0)


def test_inertia_is_in_the_axes_of_the_link():
    robot = parse_urdf(ARM)
    base, body, _ = structure_of(robot).bodies
    assert (base.mass, base.com, base.inertia) == (None, None, None)
    assert (body.mass, body.com) == (3.0, (0.1, 0.0, 0.0))
    assert body.inertia[:3] == pytest.approx((0.2, 0.1, 0.25))
    assert np.asarray(robot.model.inertias[1].inertia) == pytest.approx(np.diag(body.inertia[:3]), abs=1e-12)


def test_shapes_keep_size_colour_and_the_path_of_a_mesh():
    box, mesh, cylinder = structure_of(parse_urdf(ARM)).solids
    assert (box.kind, box.size, box.colour) == ("box", (1.0, 2.0, 3.0), (1.0, 0.0, 0.0, 0.5))
    assert box.origin.xyz == (0.0, 0.0, 1.0)
    assert (mesh.file, mesh.size, mesh.colour) == ("package://arm/body.stl", (0.001, 0.001, 0.001), None)
    assert isinstance(cylinder, Solid)
    assert (cylinder.purpose, cylinder.size) == ("collision", (0.2, 0.7))


def test_a_joint_that_mimics_another_stands_still():
    finger = '<link name="finger"/><joint name="grip" type="revolute"><parent link="tip"/><child link="finger"/>'
    finger += '<mimic joint="turn"/></joint></robot>'
    grip = structure_of(parse_urdf(ARM.replace("</robot>", finger))).connections[-1]
    assert (grip.name, grip.kind, grip.axis) == ("grip", "fixed", None)


def test_a_transform_is_that_of_its_numbers():
    origin = structure_of(parse_urdf(ARM)).connections[0].origin
    assert origin.transform[:3, :3] == pytest.approx(pin.rpy.rpyToMatrix(0.1, 0.2, 0.3))
    assert origin.transform[:3, 3] == pytest.approx((0.0, 0.0, 0.5))


def test_a_shape_against_collisions_that_cannot_be_read_is_named():
    with pytest.raises(InputError, match='URDF: collision of link "body": "thick" should be 1 finite number'):
        parse_urdf(ARM.replace('radius="0.2"', 'radius="thick"'))
