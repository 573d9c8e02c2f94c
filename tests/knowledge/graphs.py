"""Graphs of the ontology and what sources say, and what is inferred in them."""

from __future__ import annotations

from collections.abc import Iterable

import pyshacl
import rdflib
from pyoxigraph import Literal, NamedNode, Quad, RdfFormat, Triple, parse, serialize
from tests.mapped import ontology_graph

from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_INFERRED, GRAPH_REASONED, GRAPH_SOURCE, PREFIXES, SH

DRAWN = GRAPH_SOURCE + "drawn"
EX = "https://example.org/"  # of what is made up
_SPACES = PREFIXES | {
    "ex": EX,
    "sh": SH,
    "swrl": "http://www.w3.org/2003/11/swrl#",
    "swrlb": "http://www.w3.org/2003/11/swrlb#",
}
TURTLE = "".join(f"@prefix {name}: <{space}> . " for name, space in _SPACES.items()) + "\n"


def turtle(text: str) -> set[Triple]:
    """Return what a text in Turtle says; it needs to declare none of the usual prefixes."""
    return {quad.triple for quad in parse(TURTLE + text, format=RdfFormat.TURTLE)}


def quad(subject: str, predicate: str, value: str | Literal, graph: str = DRAWN) -> Quad:
    """Return a statement of a source; a text names an individual."""
    it = NamedNode(value) if isinstance(value, str) else value
    return Quad(NamedNode(subject), NamedNode(predicate), it, NamedNode(graph))


def inferred(graph: KnowledgeGraph) -> dict[str, set[Triple]]:
    """Return what each graph of what is inferred holds, but for those that are empty."""
    graphs = {name: graph.triples(name) for name in graph.graphs(GRAPH_INFERRED, GRAPH_REASONED)}
    return {name: triples for name, triples in graphs.items() if triples}


def by_pyshacl(data: Iterable[Triple], shapes: rdflib.Graph) -> set[Triple]:
    """Return triples and what pySHACL's rules conclude of them, but for what is said of nodes without a name."""
    graph = rdflib.Graph().parse(data=serialize(data, format=RdfFormat.N_TRIPLES), format="nt")
    pyshacl.validate(graph, shacl_graph=shapes, advanced=True, inplace=True, iterate_rules=True)
    text = "\n".join(line for line in graph.serialize(format="nt").splitlines() if "_:" not in line)
    return {quad.triple for quad in parse(text, format=RdfFormat.N_TRIPLES)}


def graph_of(quads: Iterable[Quad]) -> KnowledgeGraph:
    """Return the ontology's graph with quads of sources and activities."""
    graph = ontology_graph()
    graph.replace(quads, GRAPH_SOURCE, GRAPH_ACTIVITY)
    return graph


def reasoned_over(quads: Iterable[Quad]) -> KnowledgeGraph:
    """Return the same with what is inferred."""
    graph = graph_of(quads)
    reason(graph)
    return graph
