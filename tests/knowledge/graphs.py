"""Graphs of the ontology and what sources say."""

from __future__ import annotations

from collections.abc import Iterable

from pyoxigraph import Quad

from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE


def graph_of(quads: Iterable[Quad]) -> KnowledgeGraph:
    """Return the ontology's graph with quads of sources and activities."""
    graph = KnowledgeGraph()
    graph.load_ontology()
    graph.replace(quads, GRAPH_SOURCE, GRAPH_ACTIVITY)
    return graph


def reasoned_over(quads: Iterable[Quad]) -> KnowledgeGraph:
    """Return the same with what is inferred."""
    graph = graph_of(quads)
    reason(graph)
    return graph
