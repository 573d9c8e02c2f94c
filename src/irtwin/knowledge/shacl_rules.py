"""SHACL rules, each run once over all its focus nodes instead of once for each of them.

A SPARQL rule's CONSTRUCT finds its focus nodes by itself once `$this` is tied to the target class. The result
is what a SHACL engine gives, in milliseconds where that takes minutes.
"""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import cast

from pyoxigraph import QuerySolutions, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.graph import KnowledgeGraph, in_graph, read_turtle
from irtwin.knowledge.table import to_python
from irtwin.knowledge.vocabulary import GRAPH_SHACL, PREFIXES, SH
from irtwin.resources import folder

_RULES = """
SELECT ?shape ?class ?construct
WHERE { ?shape sh:rule ?rule . ?rule sh:construct ?construct .
        OPTIONAL { ?shape sh:targetClass ?class } OPTIONAL { ?rule sh:order ?order } }
ORDER BY ?order ?shape ?construct"""
_WHERE = re.compile(r"WHERE\s*\{", re.IGNORECASE)


def infer(graph: KnowledgeGraph) -> int:
    """Run the rules of the files `rules/*rules.ttl` until nothing is new; return how many triples they made."""
    made: set[Triple] = set()
    graph.replace([], GRAPH_SHACL)
    while True:
        new = {triple for rule in set_wise_rules() for triple in graph.construct(rule)} - made
        if not new:
            return len(made)
        made |= new
        graph.replace(in_graph(made, GRAPH_SHACL), GRAPH_SHACL)


@cache
def set_wise_rules() -> tuple[str, ...]:
    """Return a CONSTRUCT for each rule of the files `rules/*rules.ttl`."""
    files = sorted(folder("rules").glob("*rules.ttl"))
    return tuple(construct for file in files for construct in read_rules(file))


def read_rules(file: Path) -> tuple[str, ...]:
    """Return a CONSTRUCT for each SPARQL rule of a file; InputError for one that has no target class."""
    store = Store()
    store.extend(in_graph(read_turtle(file)))
    found = cast(QuerySolutions, store.query(_RULES, prefixes={**PREFIXES, "sh": SH}))
    return tuple(_set_wise(file, *(to_python(term) for term in row)) for row in found)


def _set_wise(file: Path, shape: str, target: str | None, construct: str) -> str:
    if target is None:
        raise InputError(f"{file}: the rule of {shape} has no sh:targetClass to find its nodes by")
    return _WHERE.sub(f"WHERE {{ $this a/rdfs:subClassOf* <{target}> .", construct, count=1)
