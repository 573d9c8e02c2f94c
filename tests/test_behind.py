"""A writer is killed: what the graph answers is whole, or it says that it is behind until it has caught up."""

from __future__ import annotations

import multiprocessing
import shutil
from pathlib import Path

import pytest
from pyoxigraph import CanonicalizationAlgorithm, Dataset, Quad
from tests import killed_writers
from tests.killed_writers import killed, take_in

from irtwin.asking import BEHIND, standing
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.knowledge.vocabulary import GRAPH_CHANGED, GRAPH_SOURCE
from irtwin.storage.database import Workspace
from irtwin.workflow import conclude, map_rows, rewriting

pytestmark = pytest.mark.slow

FORKS = multiprocessing.get_context("forkserver")
FORKS.set_forkserver_preload([killed_writers.__name__])
NOT_COMPARED = (GRAPH_CHANGED, f"{GRAPH_SOURCE}version")  # notes, and a name that is drawn


def said(graph: KnowledgeGraph) -> set[Quad]:
    found = Dataset(quad for quad in graph.quads() if quad.graph_name.value not in NOT_COMPARED)  # type: ignore[union-attr]
    found.canonicalize(CanonicalizationAlgorithm.UNSTABLE)  # blank nodes have no names of their own
    return set(found)


def answered(folder: Path) -> tuple[set[Quad], str | None]:
    with Snapshot(folder / "graph") as snapshot:
        return said(snapshot.graph), standing(snapshot.graph, folder)


def made_anew(folder: Path, tmp_path: Path) -> set[Quad]:
    """Return what a graph says that is made of the same database in one go."""
    with Workspace(folder) as place, KnowledgeGraph(workspace=folder, base=place.base) as graph:
        shutil.rmtree(tmp_path / "anew", ignore_errors=True)
        graph.load_ontology()
        place.mapped_rows.rename(tmp_path / "kept")
        map_rows(place, graph)
        (tmp_path / "kept").rename(place.mapped_rows)
        conclude(graph, lambda line: None)
        return said(graph)


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
        with Workspace(folder) as place, rewriting(place, None):
            pass
        answer, stands = answered(folder)
        assert stands is None
        assert answer == made_anew(folder, tmp_path)
    return stood


def test_a_killed_writer_leaves_a_graph_that_is_whole_or_says_that_it_is_behind(before: Path, tmp_path: Path) -> None:
    assert BEHIND in hold(before, tmp_path, [2, 5, 8])


@pytest.mark.nightly
def test_whichever_write_it_was_killed_at(before: Path, tmp_path: Path) -> None:
    stood = hold(before, tmp_path, list(range(100)))
    print(stood)
    assert stood[0] is None and 5 < stood.count(BEHIND) < 100
