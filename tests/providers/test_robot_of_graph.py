"""The robot that the graph describes is the robot of the URDF: where its links are, and how it is drawn."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests import synthetic
from tests.mapped import map_into
from tests.virtual.scene_data import HOSTILE, bare, kr6, run

from irtwin.errors import InputError
from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers.names import identifier, robot_iri
from irtwin.providers.records import ingest
from irtwin.providers.robot_of_graph import robot_of_graph
from irtwin.robot.denavit_hartenberg import ChainTable, Row
from irtwin.robot.description import Robot
from irtwin.robot.kinematics import flange, link_placements
from irtwin.robot.structure import Origin
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.log import DataSet
from irtwin.storage.database import Workspace
from irtwin.virtual.scene import scene_html

EXACT = 1e-12  # m, and an element of a rotation matrix
BRANCHED = """<robot name="two hands"><link name="base"/><link name="chest"/><link name="left"/><link name="right"/>
<link name="thumb"/><link name="nail"/>
<joint name="turn" type="revolute"><parent link="base"/><child link="chest"/><origin xyz="0 0 0.7" rpy="0.1 0 0.2"/>
  <axis xyz="0 0 1"/><limit lower="-2" upper="2" velocity="1" effort="9"/></joint>
<joint name="z left" type="continuous"><parent link="chest"/><child link="left"/><origin xyz="0 0.3 0"/>
  <axis xyz="1 2 2"/></joint>
<joint name="a right" type="prismatic"><parent link="chest"/><child link="right"/><origin xyz="0 -0.3 0" rpy="1 0 0"/>
  <axis xyz="0 1 0"/><limit lower="0" upper="0.4" velocity="1" effort="9"/></joint>
<joint name="grip" type="revolute"><parent link="right"/><child link="thumb"/><mimic joint="turn"/>
  <limit lower="0" upper="1" velocity="1" effort="1"/></joint>
<joint name="tip" type="fixed"><parent link="thumb"/><child link="nail"/><origin xyz="0 0 0.05" rpy="0 1.2 0"/></joint>
</robot>"""
ROBOTS = {
    "KR6": kr6,
    "small": lambda: synthetic.arm(3),
    "sliding": lambda: synthetic.arm(4, slides=(1,)),
    "branched": lambda: parse_urdf(BRANCHED),
    "odd name": lambda: bare(HOSTILE),
}


def described(robot: Robot, place: Path) -> KnowledgeGraph:
    """The graph of a robot without runs."""
    with Workspace(place / "workspace") as workspace:
        ingest(workspace, DataSet(place, robot, (), None, None, "mains", True, {}))
        return map_into(KnowledgeGraph(), workspace)


def poses(robot: Robot) -> np.ndarray:
    return np.random.default_rng(2).uniform(-2.0, 2.0, (5, len(robot.joints)))


def motion(row: dict[str, Any], position: float) -> np.ndarray:
    """What a joint adds at a position, written out: a shift along its axis, or Rodrigues' rotation about it."""
    moved, axis = np.eye(4), np.array([row["axis_x"], row["axis_y"], row["axis_z"]])
    if row["kind"] == "prismatic":
        moved[:3, 3] = position * axis
        return moved
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    moved[:3, :3] = np.eye(3) + np.sin(position) * cross + (1 - np.cos(position)) * cross @ cross
    return moved


def placed(rows: tuple[dict[str, Any], ...], positions: dict[str, float]) -> dict[str, np.ndarray]:
    """Where the links are, from the rows of `links_and_joints` alone."""
    places: dict[str, np.ndarray] = {}
    for row in rows:
        if row["joint"] is None:
            places[row["link"]] = np.eye(4)
            continue
        origin = Origin((row["x_m"], row["y_m"], row["z_m"]), (row["roll_rad"], row["pitch_rad"], row["yaw_rad"]))
        at = places[row["parent"]] @ origin.transform
        places[row["link"]] = at if row["kind"] == "fixed" else at @ motion(row, positions[row["joint"]])
    return places


def dh_tables(graph: KnowledgeGraph, robot: Robot) -> list[ChainTable]:
    """The tables of Denavit and Hartenberg, from the graph alone."""
    found = graph.query(
        """SELECT * { ?t irt:Convention ?convention ; ?end ?frame . VALUES ?end { irt:base_Frame irt:tool_Frame }
        ?frame irt:Origin_X ?x ; irt:Origin_Y ?y ; irt:Origin_Z ?z ;
          irt:Origin_Roll ?roll ; irt:Origin_Pitch ?pitch ; irt:Origin_Yaw ?yaw }"""
    )
    ends = {
        (row["convention"], row["end"].rpartition("#")[2]): Origin(
            (row["x"], row["y"], row["z"]), (row["roll"], row["pitch"], row["yaw"])
        ).transform
        for row in found
    }
    kinds = {joint.name: joint.kind for joint in robot.joints}
    answer = ask(graph, "dh_table").rows
    return [
        ChainTable(
            tuple(
                Row(row["a_m"], row["alpha_rad"], row["d_m"], row["theta_rad"], kinds[row["joint"]], name=row["joint"])
                for row in answer
                if row["convention"] == convention
            ),
            convention,
            ends[convention, "base_Frame"],
            ends[convention, "tool_Frame"],
        )
        for convention in ("standard", "modified")
    ]


@pytest.mark.parametrize("name", ROBOTS)
def test_urdf_graph_and_denavit_hartenberg_put_the_links_in_one_place(name: str, tmp_path: Path) -> None:
    robot = ROBOTS[name]()
    graph = described(robot, tmp_path)
    again = robot_of_graph(graph, robot_iri(identifier(robot.name)))
    assert again.joints == robot.joints
    rows = ask(graph, "links_and_joints").rows
    tables = dh_tables(graph, robot)
    for q in poses(robot):
        said, drawn = placed(rows, dict(zip(robot.joint_names, q, strict=True))), link_placements(again, q)
        places = link_placements(robot, q)
        assert set(places) == set(said) == set(drawn)
        for link, place in places.items():
            assert np.abs(said[link] - place).max() < EXACT
            assert np.abs(drawn[link] - place).max() < EXACT
        for table in tables:
            positions = q[[robot.index(joint) for joint in table.joint_names]]
            assert np.abs(table.flange(positions) - places[flange(robot)]).max() < EXACT


def test_the_scene_of_the_graph_is_that_of_the_urdf(tmp_path: Path) -> None:
    robot = kr6()
    again = robot_of_graph(described(robot, tmp_path), robot_iri(robot.name))
    assert again.name == robot.name
    assert scene_html(again, [run(robot)]) == scene_html(robot, [run(robot)])


def test_a_robot_that_the_graph_does_not_know_is_named() -> None:
    with pytest.raises(InputError, match="Nobody>: the graph does not know its links; run its data set again"):
        robot_of_graph(KnowledgeGraph(), robot_iri("Nobody"))
