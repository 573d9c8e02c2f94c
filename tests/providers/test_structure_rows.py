"""What a robot is built of and what measured it: from the data set through tables and mapping to the questions."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests import small_robots
from tests.mapped import map_into, ontology_graph

from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers.records import ingest
from irtwin.providers.structure_rows import structure_rows
from irtwin.robot.chain_table import table_of
from irtwin.robot.structure import structure_of
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.log import DataSet, read_data_set
from irtwin.storage.database import Workspace
from irtwin.storage.structure_schema import DHTable, LinkRow

Told = tuple[DataSet, KnowledgeGraph]


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> Told:
    place = tmp_path_factory.mktemp("structure")
    data_set = read_data_set(small_robots.data_set(place / "data", "Arm X", joints=3))
    with Workspace(place / "workspace") as workspace:
        assert ingest(workspace, data_set) == "new"
        assert ingest(workspace, data_set) == "unchanged"
        return data_set, map_into(ontology_graph(), workspace)


def test_links_and_joints_are_those_of_the_urdf(told: Told) -> None:
    data_set, graph = told
    structure = structure_of(data_set.robot)
    answer = ask(graph, "links_and_joints", "Arm X").rows
    assert [row["link"] for row in answer] == [body.name for body in structure.bodies]
    assert [row["mass_kg"] for row in answer] == [body.mass for body in structure.bodies]
    joints = {joint.child: joint for joint in structure.connections}
    for row in answer:
        joint = joints.get(row["link"])
        assert row["joint"] == (joint and joint.name)
        if joint is not None:
            assert (row["parent"], row["kind"]) == (joint.parent, joint.kind)
            assert (row["x_m"], row["y_m"], row["z_m"]) == joint.origin.xyz
            assert (row["roll_rad"], row["pitch_rad"], row["yaw_rad"]) == joint.origin.rpy
            assert (row["axis_x"], row["axis_y"], row["axis_z"]) == (joint.axis or (None, None, None))


def test_the_tables_of_denavit_and_hartenberg_are_those_of_the_chain(told: Told) -> None:
    data_set, graph = told
    answer = ask(graph, "dh_table", "Arm X").rows
    for convention in ("standard", "modified"):
        table = table_of(data_set.robot, convention)
        said = [row for row in answer if row["convention"] == convention]
        assert [row["joint"] for row in said] == list(table.joint_names)
        numbers = [(row["a_m"], row["alpha_rad"], row["d_m"], row["theta_rad"]) for row in said]
        assert numbers == [(row.a, row.alpha, row.d, row.theta) for row in table.rows]
        assert all(0 <= row["deviation_m"] < 1e-12 for row in said)


def test_each_column_of_the_logs_comes_from_a_device(told: Told) -> None:
    data_set, graph = told
    answer = ask(graph, "devices", "Arm X").rows
    joints = data_set.robot.joint_names
    signals = data_set.runs[0].signals
    per_joint = [
        ("encoder", "position", "rad"),
        ("torque_sensor", "torque", "N m"),
        ("current_sensor", "motor current", "A"),
    ]
    expected = {("controller", None, "time of the sample", "s"), ("power_meter", None, "electrical power", "W")}
    expected |= {(device, joint, label, unit) for joint in joints for device, label, unit in per_joint}
    assert {(row["device"], row["joint"], row["quantity"], row["unit"]) for row in answer} == expected
    rate = (len(signals.time) - 1) / (signals.time[-1] - signals.time[0])
    assert [row["rate_Hz"] for row in answer] == pytest.approx([rate] * len(answer))


def test_kinds_of_data_count_what_is_there(told: Told) -> None:
    data_set, graph = told
    counts = {row["of"]: row["count"] for row in ask(graph, "data_kinds")}
    assert counts["measured series"] == len(data_set.runs)
    assert counts["robot link"] == len(data_set.robot.links)
    assert (counts["robot joint"], counts["Denavit-Hartenberg row"], counts["modelled series"]) == (3, 6, 0)


def test_another_urdf_takes_the_place_of_all_parts(tmp_path: Path) -> None:
    with Workspace(tmp_path / "workspace") as workspace:
        ingest(workspace, read_data_set(small_robots.data_set(tmp_path / "three", "Arm", joints=3)))
        assert ingest(workspace, read_data_set(small_robots.data_set(tmp_path / "two", "Arm"))) == "replaced"
        with workspace.reading() as session:
            assert session.query(LinkRow).count() == len(read_data_set(tmp_path / "two").robot.links)
        workspace.drop_robot("Arm")
        with workspace.reading() as session:
            assert session.query(LinkRow).count() == 0


def test_a_robot_whose_flange_stands_still_has_no_table() -> None:
    deep = "".join(
        f'<link name="post_{k}"/><joint name="fix_{k}" type="fixed"><parent link="post_{k - 1}"/>'
        f'<child link="post_{k}"/></joint>'
        for k in range(1, 4)
    )
    robot = parse_urdf(
        f'<robot name="r"><link name="post_0"/>{deep}<link name="arm"/><joint name="turn" type="continuous">'
        '<parent link="post_0"/><child link="arm"/></joint></robot>'
    )
    rows = list(structure_rows("r", robot))
    assert not any(isinstance(row, DHTable) for row in rows)
    assert sum(isinstance(row, LinkRow) for row in rows) == 5
