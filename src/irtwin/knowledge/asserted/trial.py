"""A change of the graph, tried on a copy of it: what would contradict, and which constraints it would break."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from pyoxigraph import Quad

from irtwin.errors import InputError
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import view

_MOST_TOLD = 3


def check(graph: KnowledgeGraph, removed: Iterable[Quad], added: Iterable[Quad]) -> None:
    """Raise InputError where a change makes the graph contradict itself, or break a constraint that it kept.

    The graph stays as it is, and is the caller's to write.
    """
    with _copy(graph) as tried:
        before = _faults(tried)
        tried.change(removed, added)
        try:
            faults = [fault for fault in _faults(tried) if fault not in before]
        except Contradiction as clash:
            faults = [str(clash)]
    if faults:
        more = f"; and {len(faults) - _MOST_TOLD} more" if len(faults) > _MOST_TOLD else ""
        raise InputError(f"refused, nothing changed: {'; '.join(faults[:_MOST_TOLD])}{more}")


def _faults(graph: KnowledgeGraph) -> list[str]:
    contradictions = reason(graph).contradictions
    return [*contradictions, *map(str, validate(graph))]


@contextmanager
def _copy(graph: KnowledgeGraph) -> Iterator[KnowledgeGraph]:
    """Give a copy to write to: of the store's files by links, or in memory where there are none."""
    if graph.folder is not None:
        graph.flush()
        with view(graph.folder) as files:
            if files is not None:
                with KnowledgeGraph(files, None, graph.resources, graph.base) as copy:
                    yield copy
                return
    with KnowledgeGraph(None, None, graph.resources, graph.base) as copy:
        copy.replace(graph.quads(), "")
        yield copy
