"""Blank nodes, which have no name: where they are, and whether two graphs say the same whatever they are called."""

from __future__ import annotations

from collections.abc import Iterable

from pyoxigraph import BlankNode, CanonicalizationAlgorithm, Dataset, Quad, Triple


def has_blank_node(statements: Iterable[Quad | Triple]) -> bool:
    """Whether a subject or an object is a blank node."""
    return any(isinstance(term, BlankNode) for one in statements for term in (one.subject, one.object))


def same(some: set[Triple], others: set[Triple]) -> bool:
    """Whether two graphs say the same, whatever their blank nodes are called (RDFC-1.0)."""
    if some == others or len(some) != len(others):
        return some == others
    blank, other_blank = ({triple for triple in graph if has_blank_node([triple])} for graph in (some, others))
    return some - blank == others - other_blank and _canonical(blank) == _canonical(other_blank)


def _canonical(triples: Iterable[Triple]) -> Dataset:
    found = Dataset(Quad(triple.subject, triple.predicate, triple.object) for triple in triples)
    found.canonicalize(CanonicalizationAlgorithm.RDFC_1_0)
    return found
