"""Views of a graph that another process may write: whole, lasting, and gone without a trace."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest
from pyoxigraph import Literal, NamedNode, Triple

from irtwin.errors import InputError
from irtwin.knowledge.graph import KnowledgeGraph, in_graph
from irtwin.serve.snapshot import Snapshot

VALUES = "SELECT ?v { ?s <http://e/v> ?v } ORDER BY ?v"


def views(graph: Path) -> list[Path]:
    return list(graph.parent.glob(".view-*"))


def write(graph: KnowledgeGraph, number: int) -> None:
    triple = Triple(NamedNode("http://e/s"), NamedNode("http://e/v"), Literal(number))
    graph.replace(in_graph([triple], "http://e/live"), "http://e/live")


def test_a_view_lasts_when_its_files_are_removed(new_graph: Callable[[], Path]) -> None:
    """Only sixteen files are opened with the store; a query that missed another went on for ever."""
    folder = new_graph()
    with KnowledgeGraph(folder) as graph:
        for number in range(3):
            write(graph, number)
        before = {file.name for file in folder.glob("*.sst")}
        assert len(before) > 16
        with Snapshot(folder) as snapshot:
            for number in range(3, 12):
                write(graph, number)
            assert len(before - {file.name for file in folder.glob("*.sst")}) > 3
            old = snapshot.graph
            assert [row["v"] for row in old.query(VALUES).rows] == [2]
            assert len(list(old.triples())) > 1000
            assert [row["v"] for row in snapshot.current(at_once=True).query(VALUES).rows] == [11]
            assert len(views(folder)) == 1
    assert views(folder) == []


def test_what_a_killed_reader_left_is_removed_and_what_is_in_use_is_not(new_graph: Callable[[], Path]) -> None:
    folder = new_graph()
    reader = "import sys; from pathlib import Path; from irtwin.serve.snapshot import Snapshot\n"
    reader += "with Snapshot(Path(sys.argv[1])): print('open', flush=True); sys.stdin.read()"
    with subprocess.Popen(
        [sys.executable, "-c", reader, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "open\n"
        (theirs,) = views(folder)
        with Snapshot(folder):
            assert theirs in views(folder) and len(views(folder)) == 2
        process.kill()
    assert views(folder) == [theirs]
    with Snapshot(folder):
        assert theirs not in views(folder)


def test_where_there_is_no_graph(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no graph here; run `irtwin run DATASET` into this workspace first"):
        Snapshot(tmp_path / "graph")
    assert list(tmp_path.iterdir()) == []
