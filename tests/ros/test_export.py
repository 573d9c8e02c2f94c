"""What a workspace knows, written for ROS by the command line."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import pytest
from tests import mesh_robots
from tests.data_sets import irtwin, refused
from tests.endpoint import make_graph
from tests.mesh_robots import HAND, SLIDE
from tests.virtual.scene_data import kr6

from irtwin import resources
from irtwin.effects.catalogue import catalogue
from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.location import Location
from irtwin.planning.plan import nominal_twin
from irtwin.providers.records import ingest
from irtwin.robot.structure import structure_of
from irtwin.robot.urdf import read_urdf
from irtwin.ros import export
from irtwin.ros.ros_package import write_package
from irtwin.signals.log import DataSet
from irtwin.storage.database import Workspace
from irtwin.twin.twin import Parameter

pytestmark = pytest.mark.slow

KR6 = resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace that knows the KR6, without runs."""
    folder = tmp_path_factory.mktemp("workspace")
    return known_in(folder, DataSet(folder, kr6(), (), None, None, "mains", True, {}))


def known_in(folder: Path, data_set: DataSet) -> Path:
    """Make a workspace that knows a data set."""
    with Workspace(folder) as place:
        ingest(place, data_set)
        documents = sorted(resources.folder("mappings").glob("*.r2rml.ttl"))
        with KnowledgeGraph(place.graph_folder) as graph:
            graph.replace(map_database(place.engine, documents), GRAPH_SOURCE, GRAPH_ACTIVITY)
    return folder


def files(folder: Path) -> dict[str, bytes]:
    return {file.relative_to(folder).as_posix(): file.read_bytes() for file in folder.rglob("*") if file.is_file()}


def test_the_package_of_the_graph_is_that_of_the_urdf(workspace: Path, tmp_path: Path) -> None:
    said = irtwin("export", "--ros", tmp_path / "graph", "--robot", "KUKA_KR6_R700", "--workspace", workspace)
    assert (said.status, said.out, said.err) == (0, f"{tmp_path / 'graph'}\n", "")
    write_package(kr6(), tmp_path / "urdf")
    assert files(tmp_path / "graph") == files(tmp_path / "urdf")
    said = irtwin("robot", "ros", KR6, "--out", tmp_path / "command")
    assert (said.status, said.err) == (0, "")
    assert files(tmp_path / "graph") == files(tmp_path / "command")


def test_a_robot_with_a_twin_has_its_bodies_and_friction(
    workspace: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = nominal_twin(kr6())
    masses = {"link_3": 8.25}
    changed = [
        replace(one, value=masses.get(one.link or "", one.value)) if one.name == "m" else one
        for one in known.parameters
    ]
    friction = Parameter("viscous_friction", "joint_a1", None, "Fv", 3.5, "N m s/rad")
    effects = (*known.effects, catalogue()["viscous_friction"].on("joint_a1"))
    twin = replace(known, effects=effects, parameters=(*changed, friction))
    monkeypatch.setattr(export, "known_twin", lambda place, robot: (robot, twin))
    export.export_package(tmp_path / "out", Location(workspace), None)
    found = structure_of(read_urdf(tmp_path / "out" / "urdf" / "KUKA_KR6_R700.urdf"))
    before = {body.name: body.mass for body in structure_of(kr6()).bodies}
    assert {body.name: body.mass for body in found.bodies} == before | masses
    assert {one.name: one.damping for one in found.connections if one.damping} == {"joint_a1": 3.5}


def test_meshes_of_the_only_robot_of_a_workspace_go_along(tmp_path: Path) -> None:
    known_in(tmp_path / "w", mesh_robots.write(tmp_path / "data"))
    out = tmp_path / "package"
    said = irtwin("export", "--ros", out, "--workspace", tmp_path / "w")
    assert said.status == 0, said.err
    assert (out / "meshes" / "slide.stl").read_bytes() == (tmp_path / "data" / "urdf" / SLIDE).read_bytes()
    assert (out / "meshes" / "arm.dae").read_bytes() == (tmp_path / "data" / "parts" / "arm.dae").read_bytes()
    urdf = (out / "urdf" / "Meshed.urdf").read_text()
    named = [mesh.get("filename") for mesh in ElementTree.fromstring(urdf).iter("mesh")]
    assert named == [f"package://meshed_description/meshes/{file}" for file in ("slide.stl", "arm.dae")] + [HAND]
    assert 'scale="0.001 0.001 0.001"' in urdf
    assert "its meshes are of the ROS package parts, which has to be installed" in said.err  # the one that is missing
    assert "ROS finds no mesh" not in said.err
    assert (out / "CMakeLists.txt").read_text().count("DIRECTORY config launch meshes rviz urdf ") == 2
    next((tmp_path / "w" / "meshes").glob("*.stl")).unlink()
    told = refused("export", "--ros", tmp_path / "again", "--workspace", tmp_path / "w")
    assert "cannot be read" in told and told.count("\n") == 1
    assert not (tmp_path / "again").exists()


def test_a_robot_that_is_not_there_is_told(workspace: Path, tmp_path: Path) -> None:
    said = refused("export", "--ros", tmp_path / "out", "--robot", "KUKA_KR6", "--workspace", workspace)
    assert said == "irtwin: there is no robot 'KUKA_KR6': did you mean KUKA_KR6_R700?\n"
    assert not (tmp_path / "out").exists()


def test_of_several_robots_one_has_to_be_named(tmp_path: Path) -> None:
    Workspace(tmp_path).close()
    make_graph(tmp_path)
    said = refused("export", "--ros", tmp_path / "out", "--workspace", tmp_path)
    assert said.startswith("irtwin: say which robot by --robot; known are ")
