"""Which named graphs a name stands for, and what belongs into one.

A name that ends in / stands for all graphs whose IRIs begin with it, and "" for all.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pyoxigraph import NamedNode, Quad, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.store.sparql_server import SparqlServer


def in_graph(triples: Iterable[Triple], name: str | None = None) -> Iterator[Quad]:
    """Say of each triple that it belongs into the named graph, or into the default graph."""
    if name is None:  # to name the default graph takes as long as all the rest
        return (Quad(*triple) for triple in triples)
    graph = NamedNode(name)
    return (Quad(*triple, graph) for triple in triples)  # type: ignore[call-arg]


def belonging(quads: Iterable[Quad], below: tuple[str, ...]) -> Iterator[Quad]:
    """Yield the quads; ValueError at one that is of no graph `below`."""
    seen = set()
    for quad in quads:
        graph = quad.graph_name
        if graph not in seen:
            if not (isinstance(graph, NamedNode) and is_below(graph.value, below)):
                raise ValueError(f"a quad of graph {graph} does not belong into {', '.join(below)}")
            seen.add(graph)
        yield quad


def is_of_many(name: str) -> bool:
    """Whether a name stands for many graphs."""
    return not name or name.endswith("/")


def is_below(name: str, below: tuple[str, ...]) -> bool:
    """Whether one of some names stands for a graph."""
    return any(name.startswith(graph) if is_of_many(graph) else name == graph for graph in below)


def names_in(store: Store | SparqlServer) -> list[str]:
    """Return the IRIs of a store's named graphs."""
    return [graph.value for graph in store.named_graphs() if isinstance(graph, NamedNode)]


def triples_in(store: Store | SparqlServer, name: str) -> set[Triple]:
    """Return what one named graph says."""
    return {quad.triple for quad in store.quads_for_pattern(None, None, None, NamedNode(name))}


def graph_name(iri: str) -> NamedNode:
    """Return a graph's name; InputError where it is no IRI."""
    try:
        return NamedNode(iri)
    except ValueError as error:
        raise InputError(f"{iri!r} is not the name of a graph: {error}") from error
