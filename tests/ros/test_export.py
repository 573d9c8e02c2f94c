"""What a workspace knows, written for ROS by the command line."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.data_sets import irtwin
from tests.endpoint import make_graph
from tests.virtual.scene_data import kr6

from irtwin import resources
from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.providers.records import ingest
from irtwin.ros.ros_package import write_package
from irtwin.signals.log import DataSet
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.slow

KR6 = resources.folder("ontology") / "robots" / "kuka_kr6_r700.urdf"


@pytest.fixture(scope="module")
def workspace(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace that knows the KR6, without runs."""
    folder = tmp_path_factory.mktemp("workspace")
    with Workspace(folder) as place:
        ingest(place, DataSet(folder, kr6(), (), None, None, "mains", True, {}))
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


def test_the_only_robot_need_not_be_named(workspace: Path, tmp_path: Path) -> None:
    assert irtwin("export", "--ros", tmp_path / "out", "--workspace", workspace).status == 0
    assert (tmp_path / "out" / "package.xml").is_file()


def test_a_robot_that_is_not_there_is_told(workspace: Path, tmp_path: Path) -> None:
    said = irtwin("export", "--ros", tmp_path / "out", "--robot", "KUKA_KR6", "--workspace", workspace)
    assert (said.status, said.err) == (2, "irtwin: there is no robot 'KUKA_KR6': did you mean KUKA_KR6_R700?\n")
    assert not (tmp_path / "out").exists()


def test_of_several_robots_one_has_to_be_named(tmp_path: Path) -> None:
    Workspace(tmp_path).close()
    make_graph(tmp_path)
    said = irtwin("export", "--ros", tmp_path / "out", "--workspace", tmp_path)
    assert said.status == 2
    assert said.err.startswith("irtwin: say which robot by --robot; known are ")


def test_one_form_is_asked_for(workspace: Path, tmp_path: Path) -> None:
    said = irtwin("export", "--workspace", workspace)
    assert said.status == 2
    assert "Give --owl or --ros" in said.err
    said = irtwin("export", "--owl", tmp_path / "a.owl", "--robot", "KUKA_KR6_R700", "--workspace", workspace)
    assert said.status == 2
    assert "--owl writes the whole graph; leave --robot out." in said.err
