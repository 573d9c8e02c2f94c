"""A writer is killed: what the graph answers is whole, or it says that it is behind until it has caught up."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from pyoxigraph import NamedNode, Quad

from irtwin.asking import BEHIND, UPDATING, ask, standing
from irtwin.errors import GraphBehind, InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.knowledge.vocabulary import GRAPH_CHANGED, GRAPH_REASONED, GRAPH_SOURCE
from irtwin.providers.names import find_robot
from irtwin.rewriting import conclude, map_rows, rewriting
from irtwin.status import status
from irtwin.storage import turns
from irtwin.storage.database import Workspace
from irtwin.storage.journal import Header, Journal
from irtwin.storage.schema import LIVE
from tests import data_sets, sparql_servers
from tests.forks import FORKS
from tests.killed_writers import broken_off, killed, take_in
from tests.mapped import said

pytestmark = pytest.mark.slow

NOT_COMPARED = (GRAPH_CHANGED, f"{GRAPH_SOURCE}version")  # notes, and a name that is drawn


def answered(folder: Path) -> tuple[set[Quad], str | None]:
    with Snapshot(folder / "graph") as snapshot:
        return said(snapshot.graph, *NOT_COMPARED), standing(snapshot.graph, folder)


def made_anew(folder: Path, tmp_path: Path, database: str | None = None) -> set[Quad]:
    """Return what a graph says that is made of the same database in one go."""
    with Workspace(folder, database) as place, KnowledgeGraph(workspace=folder, base=place.base) as graph:
        graph.load_ontology()
        place.mapped_rows.rename(tmp_path / "kept")
        map_rows(place, graph)
        (tmp_path / "kept").rename(place.mapped_rows)
        conclude(graph, lambda line: None)
        return said(graph, *NOT_COMPARED)


@pytest.fixture(scope="module")
def before(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("before")
    take_in(folder, "A")
    return folder


def killed_at(moment: int, before: Path, folder: Path) -> bool:
    """Have a process take in another robot and be killed; return whether it was, or ended before."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(before, folder)
    process = FORKS.Process(target=killed, args=(moment, folder, "B"))
    process.start()
    process.join(120)
    assert process.exitcode in (0, -9)
    return process.exitcode == -9


def hold(before: Path, tmp_path: Path, moments: list[int]) -> list[str | None]:
    """Kill at each moment, and look; return how the graph stood."""
    whole = [answered(before)[0]]
    assert not killed_at(-1, before, tmp_path / "whole")
    whole.append(answered(tmp_path / "whole")[0])
    stood = []
    for moment in moments:
        folder = tmp_path / "killed"
        if not killed_at(moment, before, folder):
            break
        answer, stands = answered(folder)
        assert stands == BEHIND or answer in whole
        stood.append(stands)
        with Workspace(folder) as place, rewriting(place):
            pass
        answer, stands = answered(folder)
        assert stands is None
        assert answer == made_anew(folder, tmp_path)
    return stood


@pytest.mark.nightly
def test_a_killed_writer_leaves_a_graph_that_is_whole_or_says_that_it_is_behind(before: Path, tmp_path: Path) -> None:
    assert BEHIND in hold(before, tmp_path, [2, 6])


@pytest.mark.nightly
def test_whichever_write_it_was_killed_at(before: Path, tmp_path: Path) -> None:
    stood = hold(before, tmp_path, list(range(100)))
    print(stood)
    assert stood[0] is None and 5 < stood.count(BEHIND) < 100


def without_notes(quads: set[Quad]) -> set[Quad]:
    """Leave out of what the conclusions were made: a server's graph is reasoned over as one part."""
    return {quad for quad in quads if quad.graph_name != NamedNode(GRAPH_REASONED)}


@pytest.mark.system
@pytest.mark.nightly
@pytest.mark.parametrize("moment", [2, 6, 10])
def test_on_servers_as_well(tmp_path: Path, new_postgresql_database: Callable[[], str], moment: int) -> None:
    database = new_postgresql_database()
    with sparql_servers.oxigraph() as server:
        take_in(tmp_path, "A", database, server.url)
        process = FORKS.Process(target=killed, args=(moment, tmp_path, "B", database, server.url))
        process.start()
        process.join(120)
        assert process.exitcode == -9
        with KnowledgeGraph(server.url, tmp_path) as graph:
            assert standing(graph, tmp_path) == BEHIND
            with Workspace(tmp_path, database, graph_url=server.url) as place, rewriting(place):
                pass
            assert standing(graph, tmp_path) is None
            assert without_notes(said(graph, *NOT_COMPARED)) == without_notes(made_anew(tmp_path, tmp_path, database))


@pytest.fixture
def folder(before: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(before, tmp_path / "workspace"))


def test_a_writer_at_work_is_told_apart(folder: Path) -> None:
    broken_off(folder, "B")
    assert answered(folder)[1] == BEHIND
    with Workspace(folder) as place, turns.rewriting_alone(place.engine, folder):
        assert answered(folder)[1] == UPDATING


def test_who_asks_is_warned(folder: Path) -> None:
    broken_off(folder, "B")
    with pytest.warns(GraphBehind, match=r"behind the database, .*; `irtwin workspace reason --workspace \S+` catches"):
        ask("ASK {}", folder)
    (fault,) = status(folder).faults
    assert "behind the database" in fault
    done = data_sets.irtwin("query", "ASK {}", "--workspace", folder)
    assert done.status == 0 and done.err.startswith(f"irtwin: {folder}: the graph is behind the database")
    assert data_sets.irtwin("workspace", "reason", "--workspace", folder, "--quiet").status == 0
    assert not status(folder).faults and not data_sets.irtwin("query", "ASK {}", "--workspace", folder).err


def test_what_fails_before_it_changes_anything_leaves_the_graph_whole(folder: Path) -> None:
    with pytest.raises(InputError, match="no robot"), Workspace(folder) as place, rewriting(place):
        find_robot(place, "Nobody")
    assert answered(folder)[1] is None


def test_runs_that_a_killed_live_left_are_told(folder: Path) -> None:
    journal = Journal(folder / LIVE, Header("A.live_1", "A", 0.0, ("time",)))
    assert not status(folder).faults  # it is watched just now
    journal.close()
    (fault,) = status(folder).faults
    assert fault.startswith("A.live_1 is in the graph as it was when `irtwin live` was killed; the next `irtwin live`")
