"""Views of a graph that another process may write: whole, lasting, and gone without a trace."""

from __future__ import annotations

import itertools
import subprocess
import sys
from pathlib import Path

import pytest
from pyoxigraph import Literal, NamedNode, Triple
from tests.endpoint import make_graph

from irtwin.errors import InputError
from irtwin.knowledge.store import snapshot
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.snapshot import Snapshot, kept

VALUES = "SELECT ?v { ?s <http://e/v> ?v } ORDER BY ?v"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A graph of the ontology and two robots."""
    return make_graph(tmp_path)


def views(graph: Path) -> list[Path]:
    return list(graph.parent.glob(".view-*"))


def write(graph: KnowledgeGraph, number: int) -> None:
    triple = Triple(NamedNode("http://e/s"), NamedNode("http://e/v"), Literal(number))
    graph.replace(in_graph([triple], "http://e/live"), "http://e/live")


@pytest.mark.slow
def test_a_view_lasts_when_its_files_are_removed(folder: Path) -> None:
    """Only sixteen files are opened with the store; a query that missed another went on for ever."""
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


def test_what_a_killed_reader_left_is_removed_and_what_is_in_use_is_not(folder: Path) -> None:
    reader = "import sys; from pathlib import Path; from irtwin.knowledge.store.snapshot import Snapshot\n"
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


def test_a_graph_whose_files_never_hold_still_is_busy_and_not_damaged(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    changes = itertools.count()
    monkeypatch.setattr(snapshot, "_belonging", lambda folder: ((str(next(changes)), 0, 0),))
    monkeypatch.setattr(snapshot, "_PATIENCE", 0.0)
    monkeypatch.setattr(snapshot, "_MOST_PATIENCE", 0.2)
    for gone in (False, True):
        if gone:
            (folder / "CURRENT").write_text("MANIFEST-of-another-moment\n")
            monkeypatch.setattr(snapshot, "check_files", lambda folder: None)
        with pytest.raises(InputError, match="another process keeps changing the graph's files; try again"):
            Snapshot(folder)


def seen(snapshot: Snapshot) -> list[int]:
    return [row["v"] for row in snapshot.current(at_once=True).query(VALUES).rows]


@pytest.mark.slow
def test_readers_see_the_last_whole_graph_while_it_is_rewritten(folder: Path) -> None:
    with KnowledgeGraph(folder) as graph:
        write(graph, 1)
        with Snapshot(folder) as early:
            with kept(folder):
                for number in range(2, 8):
                    write(graph, number)
                with Snapshot(folder) as late:
                    assert seen(early) == seen(late) == [1]
            assert seen(early) == [7]
            write(graph, 8)
            assert seen(early) == [8]
    assert views(folder) == []


@pytest.mark.slow
def test_what_a_killed_writer_kept_is_seen_no_more(folder: Path) -> None:
    with KnowledgeGraph(folder) as graph:
        write(graph, 1)
    writer = """
import sys
from pathlib import Path
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import kept
folder = Path(sys.argv[1])
with KnowledgeGraph(folder) as graph, kept(folder):
    graph.update("DELETE WHERE { ?s <http://e/v> ?v } ; INSERT DATA { <http://e/s> <http://e/v> 2 }")
    print("written", flush=True)
    sys.stdin.read()
"""
    with subprocess.Popen(
        [sys.executable, "-c", writer, str(folder)], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "written\n"
        with Snapshot(folder) as snapshot:
            assert seen(snapshot) == [1]
            process.kill()
            process.wait()
            assert seen(snapshot) == [2]
    with Snapshot(folder) as snapshot:
        assert seen(snapshot) == [2]
    assert views(folder) == []


@pytest.mark.parametrize("reason", [PermissionError(1, "not permitted"), OSError(28, "no space left on device")])
def test_where_no_links_can_be_made_it_is_read_in_place(
    folder: Path, monkeypatch: pytest.MonkeyPatch, reason: OSError
) -> None:
    def refuse(*_: object) -> None:
        raise reason

    monkeypatch.setattr("os.link", refuse)
    with Snapshot(folder) as snapshot:
        assert len(snapshot.graph.triples()) > 1000
        assert views(folder) == []
    with KnowledgeGraph(folder) as graph, kept(folder), Snapshot(folder) as snapshot:
        write(graph, 1)
        assert seen(snapshot) == [1]
