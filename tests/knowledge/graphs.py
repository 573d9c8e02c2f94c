"""Graphs of the ontology and what sources say, and what is inferred in them."""

from __future__ import annotations

from collections.abc import Iterable

from pyoxigraph import Literal, NamedNode, Quad, Triple

from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_INFERRED, GRAPH_REASONED, GRAPH_SOURCE

DRAWN = GRAPH_SOURCE + "drawn"


def quad(subject: str, predicate: str, value: str | Literal, graph: str = DRAWN) -> Quad:
    """Return a statement of a source; a text names an individual."""
    it = NamedNode(value) if isinstance(value, str) else value
    return Quad(NamedNode(subject), NamedNode(predicate), it, NamedNode(graph))


def inferred(graph: KnowledgeGraph) -> dict[str, set[Triple]]:
    """Return what each graph of what is inferred holds, but for those that are empty."""
    graphs = {name: graph.triples(name) for name in graph.graphs(GRAPH_INFERRED, GRAPH_REASONED)}
    return {name: triples for name, triples in graphs.items() if triples}


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
