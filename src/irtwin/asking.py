"""Answers from a workspace's graph as it stands: nothing is written, no lock is taken, no writer is waited for."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from irtwin.errors import GraphBehind, InputError
from irtwin.knowledge.questions import queries
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.knowledge.store.table import AnswerTable
from irtwin.location import WORKSPACE, Location
from irtwin.resources import Resources, resources_of

if TYPE_CHECKING:
    from irtwin.knowledge.explain.explanation import Explanation

Current = Callable[[bool], KnowledgeGraph]  # the graph as it is now; True: not even half a second old
BEHIND, UPDATING = "behind", "updating"  # the standing of a graph that is not whole


def ask(question: str, workspace: Location | Path | str = WORKSPACE, *, robot: str | None = None) -> AnswerTable:
    """Answer a named question, of all robots or of one by its name, or one in SPARQL, from a workspace's graph.

    Raises InputError where there is no graph or no answer.
    """
    with open_graph(Location.of(workspace)) as graph:
        return queries.ask(graph, question, robot)


def explain(triple: str, workspace: Location | Path | str = WORKSPACE) -> tuple[Explanation, ...]:
    """Explain the triples of a workspace's graph that fit a pattern of subject, predicate and object."""
    from irtwin.knowledge.explain.explain import explain as explain_triples

    with open_graph(Location.of(workspace)) as graph:
        return explain_triples(graph, triple)


def export(owl: Path | str, workspace: Location | Path | str = WORKSPACE) -> None:
    """Write a workspace's ontology, individuals and inferences as one RDF/XML file."""
    from irtwin.knowledge.store.export import export_owl

    with open_graph(Location.of(workspace)) as graph:
        export_owl(graph, Path(owl))


def questions(workspace: Path = WORKSPACE) -> AnswerTable:
    """Return the questions that have a name, theme by theme; `of` says which can be asked of one robot."""
    known = queries.named_questions(checked(workspace)).values()
    rows = (
        {"theme": q.theme, "name": q.name, "of": "robot" if q.of_robot else None, "question": q.question} for q in known
    )
    return AnswerTable(("theme", "name", "of", "question"), tuple(rows))


@contextmanager
def open_graph(location: Location) -> Iterator[KnowledgeGraph]:
    """Give a workspace's graph, in its folder or on a server, as it stands.

    One that is behind the database is told by the warning GraphBehind. Raises InputError where there is none, or for a
    fault in what extends the workspace.
    """
    workspace = location.folder
    checked(workspace)
    if location.graph_url is None and not location.graph_folder.is_dir():
        from irtwin.storage.database import Workspace

        with Workspace.existing(workspace) as place:  # says that there is none, or that its graph is lost
            place.check_graph()
        raise InputError(f"{workspace}: no graph here; run `irtwin run DATASET --workspace {workspace}` first")
    with reading(location) as current:
        _warn(current(False), workspace)
        yield current(False)


@contextmanager
def reading(location: Location) -> Iterator[Current]:
    """Give what gives the graph as it is. Raises InputError where there is none."""
    if location.graph_url is None:
        with Snapshot(location.graph_folder) as snapshot:
            yield snapshot.current
    else:
        with KnowledgeGraph(location.graph_url, location.folder) as graph:
            yield lambda at_once: graph


def standing(graph: KnowledgeGraph, workspace: Path) -> str | None:
    """Return BEHIND, or UPDATING where a process is at work on it; None of a graph that is whole."""
    if not graph.is_behind:
        return None
    from irtwin.storage.turns import is_rewritten  # takes a while to import

    if is_rewritten(workspace):
        return UPDATING
    return BEHIND if graph.is_behind else None  # a server's may have become whole meanwhile


def in_words(standing: str, workspace: Path) -> str:
    """Return the line that says so to people."""
    if standing == UPDATING:
        return f"{workspace}: the graph is being updated just now: answers may lack something; ask again in a moment"
    return (
        f"{workspace}: the graph is behind the database, as a command was broken off or failed: answers may lack "
        f"something, or hold what is over; `irtwin workspace reason --workspace {workspace}` catches up"
    )


def _warn(graph: KnowledgeGraph, workspace: Path) -> None:
    standing_now = standing(graph, workspace)
    if standing_now is not None:
        warnings.warn(GraphBehind(in_words(standing_now, workspace)), stacklevel=5)  # whoever asks a question


def contradictions(graph: KnowledgeGraph) -> list[str]:
    """Return, in words, which statements of a graph contradict each other."""
    return [row["why"] for row in graph.query("SELECT DISTINCT ?why { ?of irt:Contradiction ?why } ORDER BY ?why")]


def checked(workspace: Path) -> Resources:
    """Return the ontology, rules, questions and so on that hold for a workspace.

    Raises InputError for a fault in what extends it.
    """
    resources = resources_of(workspace)
    if resources.extensions:
        from irtwin.knowledge.extensions import check  # takes a while to import

        check(resources)
    return resources
