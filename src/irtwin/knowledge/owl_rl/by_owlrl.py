"""The closure as the package owlrl draws it: another author's reading of the same rules, to check ours by."""

from __future__ import annotations

from collections.abc import Iterable
from functools import cache

import owlrl
import rdflib
from pyoxigraph import Triple
from rdflib import OWL, RDF

from irtwin.errors import InputError
from irtwin.knowledge.owl_rl.closure import Contradiction, says_something
from irtwin.knowledge.rdflib_terms import from_rdflib, to_rdflib

MOST_TRIPLES = 300_000
SECONDS_PER_TRIPLE = 1e-3  # measured from 4,000 to 80,000 triples

_ERRORS = rdflib.Namespace("http://www.daml.org/2002/03/agents/agent-ont#")
_ILL_TYPED = "Lexical value of the literal"  # owlrl says so of every zero that is a double


def check_size(triples: int) -> None:
    """Raise InputError where owlrl would take too long."""
    if triples > MOST_TRIPLES:
        raise InputError(
            f"owlrl would take {triples * SECONDS_PER_TRIPLE / 60:.0f} minutes or more for {triples:,} triples; "
            f"{MOST_TRIPLES:,} are the most: leave out --engine"
        )


def inferred(triples: Iterable[Triple]) -> set[Triple]:
    """Return every triple that follows and was not given; Contradiction says what owlrl found wrong first."""
    given = set(triples)
    return {triple for triple in _closed(given) if triple not in given}


def worth_keeping(triples: Iterable[Triple]) -> set[Triple]:
    """Return what follows and is worth keeping in a graph, as `Closure.worth_keeping` has it."""
    return {triple for triple in inferred(triples) - _truisms() if says_something(triple)}


@cache
def _truisms() -> frozenset[Triple]:
    """Return what follows from nothing."""
    return frozenset(_closed([]))


def _closed(triples: Iterable[Triple]) -> set[Triple]:
    graph = rdflib.Graph()
    for subject, predicate, object in triples:
        graph.add((to_rdflib(subject), to_rdflib(predicate), to_rdflib(object)))
    ends = _repeat_last_keys(graph)
    owlrl.DeductiveClosure(owlrl.OWLRL_Semantics).expand(graph)
    for end, repeated in ends.items():
        graph.remove((repeated, None, None))
        graph.remove((None, None, repeated))
        graph.add((end, RDF.rest, RDF.nil))
    for error in graph.objects(None, _ERRORS.error):
        if not str(error).startswith(_ILL_TYPED):
            raise Contradiction(f"statements contradict each other, owlrl finds: {error}")
    statements = (statement for statement in graph if not {*statement} & {_ERRORS.error, _ERRORS.ErrorMessage})
    return {
        Triple(*map(from_rdflib, statement))
        for statement in statements
        if isinstance(statement[1], rdflib.URIRef) and not isinstance(statement[0], rdflib.Literal)
    }


def _repeat_last_keys(graph: rdflib.Graph) -> dict[rdflib.term.Node, rdflib.BNode]:
    """Say the last property of each key twice, as owlrl 7.6 never compares the last; return what follows which cell."""
    ends: dict[rdflib.term.Node, rdflib.BNode] = {}
    for end, key in list(graph.subject_objects(RDF.first)):
        is_last = (end, RDF.rest, RDF.nil) in graph
        if is_last and any((None, OWL.hasKey, cell) in graph for cell in graph.transitive_subjects(RDF.rest, end)):
            repeated = ends[end] = rdflib.BNode()
            graph.set((end, RDF.rest, repeated))
            graph.add((repeated, RDF.first, key))
            graph.add((repeated, RDF.rest, RDF.nil))
    return ends
