"""Writing named graphs so that the default graph stays their union: quads, and the text of updates."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from pyoxigraph import Quad, Triple


def with_union(quads: Iterable[Quad]) -> Iterator[Quad]:
    """Yield each quad, and its triple for the default graph."""
    for quad in quads:
        yield quad
        yield Quad(*quad.triple)


def replacement(name: str, triples: set[Triple]) -> str:
    """Return the SPARQL Update that swaps a named graph's content, and keeps the default graph the union."""
    text = "\n".join(f"{triple} ." for triple in triples)
    return f"""
    DELETE {{ ?s ?p ?o }} WHERE {{
      GRAPH <{name}> {{ ?s ?p ?o }}
      FILTER NOT EXISTS {{ GRAPH ?other {{ ?s ?p ?o }} FILTER(?other != <{name}>) }}
    }} ;
    DROP SILENT GRAPH <{name}> ;
    INSERT DATA {{ {text} GRAPH <{name}> {{ {text} }} }}"""


def quad_data(quads: Iterable[Quad]) -> str:
    """Write quads of named graphs as SPARQL's QuadData, the triples of each graph together."""
    by_graph: dict[Any, list[Triple]] = {}
    for quad in quads:
        by_graph.setdefault(quad.graph_name, []).append(quad.triple)
    return "\n".join(f"GRAPH {name} {{ {triple_data(triples)} }}" for name, triples in by_graph.items())


def triple_data(triples: Iterable[Triple]) -> str:
    """Write triples as SPARQL's TriplesTemplate."""
    return " .\n".join(map(str, triples))
