"""A graph that was left behind is served with a word of it, and brought up to date meanwhile."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest
from tests.endpoint import serving
from tests.killed_writers import broken_off, take_in
from tests.waiting import wait_for

from irtwin.knowledge.store.graph import KnowledgeGraph

pytestmark = pytest.mark.slow
ROBOT = "/irtwin/id/robot/A"


@pytest.fixture(scope="module")
def left_behind(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A workspace with a robot in its database that its graph does not know."""
    folder = tmp_path_factory.mktemp("left")
    take_in(folder, "A")
    broken_off(folder, "B")
    return folder


@pytest.mark.nightly
def test_it_catches_up_by_itself(left_behind: Path, tmp_path: Path) -> None:
    shutil.copytree(left_behind, tmp_path / "workspace")
    with serving(tmp_path / "workspace/graph") as server:
        wait_for(lambda: "irtwin-graph" not in server.ask("ASK {}").headers, 300)
        assert server.get("/irtwin/id/robot/B", Accept="text/turtle").status_code == 200
        assert "irtwin-graph" not in server.get("/", Accept="text/html").headers


@pytest.mark.nightly
def test_where_it_cannot_it_says_why_once_and_all_that_answers_says_that_it_is_behind(
    left_behind: Path, tmp_path: Path
) -> None:
    shutil.copytree(left_behind, tmp_path / "workspace")
    graph = tmp_path / "workspace/graph"
    with KnowledgeGraph(graph), serving(graph) as server:
        said = server.process.stderr.readline()
        assert "behind the database, and cannot catch up: " in said and "it is open already" in said
        for path in ("/", ROBOT.removeprefix("/irtwin/id"), ROBOT):
            page = server.get(path, Accept="text/html")
            assert page.headers["irtwin-graph"] == "behind" and "The graph is behind the database." in page.text
        for path, accept in ((ROBOT, "text/turtle"), ("/sparql?query=ASK{}", "*/*"), ("/sparql", "text/turtle")):
            assert server.get(path, Accept=accept).headers["irtwin-graph"] == "behind"
        assert "irtwin-graph" not in server.get("/questions", Accept="text/html").headers
