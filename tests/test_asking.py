"""Readers of a workspace: they wait for no writer, need no database, and write nothing."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from irtwin import rewriting
from irtwin.asking import ask, explain, export, questions
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage.database import Workspace
from tests.endpoint import make_graph

pytestmark = pytest.mark.slow

ROBOTS = "SELECT ?robot { ?robot a irt:Industrial_Robot }"


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A workspace whose graph holds more than its database."""
    Workspace(tmp_path).close()
    make_graph(tmp_path)
    return tmp_path


@pytest.fixture
def writer(workspace: Path) -> Iterator[KnowledgeGraph]:
    """Who has the graph open to write."""
    with KnowledgeGraph(workspace / "graph") as graph:
        yield graph


def test_a_question_is_answered_while_another_process_writes(workspace: Path, writer: KnowledgeGraph) -> None:
    assert len(ask(ROBOTS, workspace)) == 2
    writer.update("INSERT DATA { <r> a irt:Industrial_Robot }")
    assert len(ask(ROBOTS, workspace)) == 3
    with ThreadPoolExecutor(4) as threads:
        assert [len(found) for found in threads.map(lambda _: ask(ROBOTS, workspace), range(8))] == [3] * 8


def test_a_run_shows_its_graph_when_it_has_ended(workspace: Path) -> None:
    with Workspace(workspace) as place:
        with rewriting.rewriting(place) as graph:
            graph.update("DELETE WHERE { ?robot a irt:Industrial_Robot }")
            assert len(ask(ROBOTS, workspace)) == 2
        assert len(ask(ROBOTS, workspace)) == 0


def test_so_are_the_other_readers(workspace: Path, writer: KnowledgeGraph, tmp_path: Path) -> None:
    owl = tmp_path / "graph.owl"
    export(owl, workspace)
    assert b"Industrial_Robot" in owl.read_bytes()
    (found, *_) = explain("? rdf:type irt:Industrial_Robot", workspace)
    assert "Industrial_Robot" in found.what


def test_a_reader_leaves_the_workspace_as_it_was(workspace: Path) -> None:
    before = sorted(workspace.rglob("*"))
    ask("robots", workspace)
    assert sorted(workspace.rglob("*")) == before


def test_relative_names_are_individuals(workspace: Path) -> None:
    (row,) = ask("SELECT (<robot/UR10> AS ?robot) {}", workspace)
    assert row["robot"] == "https://w3id.org/irtwin/id/robot/UR10"


def test_where_there_is_no_workspace(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no workspace here; run `irtwin run DATASET --workspace "):
        ask("robots", tmp_path / "none")


def test_questions_have_themes() -> None:
    assert {"theme", "name", "of", "question"} == set(questions().columns)


@pytest.mark.skipif(sys.platform != "linux", reason="the kernel's filter is Linux'")
def test_the_command_that_asks_has_no_network() -> None:
    code = """
import socket
from irtwin import asking, cli
asking.ask = lambda *_, **__: socket.socket()
cli.cli(["query", "robots"], standalone_mode=False)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert "PermissionError" in done.stderr


def test_asking_imports_nothing_that_it_does_not_need(tmp_path: Path) -> None:
    """The physics and the readers of series take longer to import than a query to answer."""
    heavy = {"numpy", "scipy", "pinocchio", "pyarrow", "rdflib", "sqlalchemy", "starlette", "jinja2"}
    with KnowledgeGraph(tmp_path / "graph") as graph:
        graph.update('INSERT DATA { id:robot irt:Note "mine" }')
    code = f"""
import sys
from irtwin import cli
for asked in ("energy_per_joint", "SELECT * {{ ?s ?p ?o }}"):
    cli.cli(["query", asked, "--workspace", {str(tmp_path)!r}], standalone_mode=False)
print({heavy!r} & set(sys.modules))
"""
    said = subprocess.check_output([sys.executable, "-c", code], text=True)
    assert "mine" in said
    assert said.splitlines()[-1] == "set()"
