"""A robot with meshes, one of them missing; of its joints one slides, and one mimics another."""

from __future__ import annotations

from pathlib import Path

import trimesh

from irtwin.robot.description import Robot
from irtwin.robot.urdf import parse_urdf, read_urdf
from irtwin.signals.log import DataSet

LIMIT = '<limit lower="-1" upper="1" velocity="1" effort="1"/>'
URDF = f"""<robot name="Meshed">
<link name="base"><visual><geometry><box size="0.3 0.3 0.1"/></geometry></visual></link>
<link name="slide"><visual><origin xyz="0 0 0.1"/><geometry>
<mesh filename="meshes/slide.stl" scale="0.001 0.001 0.001"/></geometry>
<material name="red"><color rgba="0.9 0.05 0.05 1"/></material></visual></link>
<link name="arm"><visual><geometry><mesh filename="package://parts/arm.dae"/></geometry></visual>
<collision><geometry><box size="9 9 9"/></geometry></collision></link>
<link name="hand"><visual><geometry><mesh filename="package://parts/hand.stl"/></geometry></visual>
<collision><origin xyz="0 0 0.05"/><geometry><cylinder radius="0.05" length="0.1"/></geometry></collision></link>
<link name="thumb"><collision><geometry><sphere radius="0.03"/></geometry></collision></link>
<joint name="lift" type="prismatic"><parent link="base"/><child link="slide"/><axis xyz="0 0 1"/>{LIMIT}</joint>
<joint name="turn" type="revolute"><parent link="slide"/><child link="arm"/><origin xyz="0 0 0.3"/><axis xyz="0 1 0"/>
{LIMIT}</joint>
<joint name="wrist" type="revolute"><parent link="arm"/><child link="hand"/><origin xyz="0 0 0.4"/><axis xyz="1 0 0"/>
{LIMIT}</joint>
<joint name="grip" type="revolute"><parent link="hand"/><child link="thumb"/><origin xyz="0.05 0 0.1"/>
<axis xyz="0 1 0"/><mimic joint="wrist"/>{LIMIT}</joint></robot>"""
SLIDE, ARM, HAND = "meshes/slide.stl", "package://parts/arm.dae", "package://parts/hand.stl"


def write(folder: Path) -> DataSet:
    """Write the robot with its meshes into a folder, without runs."""
    (folder / "urdf" / "meshes").mkdir(parents=True)
    (folder / "parts").mkdir()
    (folder / "urdf" / "robot.urdf").write_text(URDF)
    (folder / "urdf" / SLIDE).write_bytes(trimesh.creation.box((150, 150, 400)).export(file_type="stl"))
    (folder / "parts" / "arm.dae").write_bytes(trimesh.creation.capsule(0.4, 0.06).export(file_type="dae"))
    robot = read_urdf(folder / "urdf" / "robot.urdf")
    return DataSet(folder, robot, (), None, None, "mains", True, {}, urdf=folder / "urdf" / "robot.urdf")


def robot() -> Robot:
    """The robot alone."""
    return parse_urdf(URDF)
