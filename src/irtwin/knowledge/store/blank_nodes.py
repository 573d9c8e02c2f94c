"""Blank nodes, which have no name: where they are, and whether two graphs say the same whatever they are called."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from hashlib import sha256
from secrets import token_hex
from typing import cast

from pyoxigraph import BlankNode, CanonicalizationAlgorithm, Dataset, Literal, NamedNode, Quad, Triple

Object = NamedNode | BlankNode | Literal | Triple
_NAMED_AT_ONCE = 5_000  # IRIs in a query


def has_blank_node(statements: Iterable[Quad | Triple]) -> bool:
    """Whether a subject or an object is a blank node."""
    return any(
        isinstance(term, BlankNode) for statement in statements for term in (statement.subject, statement.object)
    )


def named_by_content(triples: Iterable[Triple], content: bytes) -> Iterator[Triple]:
    """Call the blank nodes of a file by its content and their order: read anew it is the same, and others are not.

    What was worked out of an ontology then holds for each graph that has it.
    """
    file, names = sha256(content).hexdigest()[:24], dict[BlankNode, BlankNode]()

    def named(term: Object) -> Object:
        if isinstance(term, Triple):
            return Triple(*map(named, term))  # type: ignore[arg-type]
        return names.setdefault(term, BlankNode(f"f{file}n{len(names)}")) if isinstance(term, BlankNode) else term

    may_be_blank = (BlankNode, Triple)
    return (
        cast(Triple, named(triple))
        if isinstance(triple.subject, may_be_blank) or isinstance(triple.object, may_be_blank)
        else triple
        for triple in triples
    )


def named_below(quads: Iterable[Quad], place: str) -> set[Quad]:
    """Return quads with an IRI of their own below a place for each blank node (RDF 1.1, section 3.5)."""
    names: dict[BlankNode, NamedNode] = {}

    def named(term: Object) -> Object:
        if isinstance(term, BlankNode):
            return names.setdefault(term, NamedNode(place + token_hex(12)))
        return term

    return {Quad(named(q.subject), q.predicate, named(q.object), q.graph_name) for q in quads}  # type: ignore[arg-type]


def same(some: set[Triple], others: set[Triple]) -> bool:
    """Whether two graphs say the same, whatever their blank nodes are called (RDFC-1.0)."""
    if some == others or len(some) != len(others):
        return some == others
    blank, other_blank = ({triple for triple in graph if has_blank_node([triple])} for graph in (some, others))
    return some - blank == others - other_blank and _canonical(blank) == _canonical(other_blank)


def _canonical(triples: Iterable[Triple]) -> Dataset:
    dataset = Dataset(Quad(triple.subject, triple.predicate, triple.object) for triple in triples)
    dataset.canonicalize(CanonicalizationAlgorithm.RDFC_1_0)
    return dataset


def by_name(nodes: Iterable[NamedNode | BlankNode]) -> tuple[list[str], list[BlankNode]]:
    """Return the IRIs among nodes, some thousand at a time, and the others, which no query can name."""
    terms = list(nodes)
    named = [str(node) for node in terms if isinstance(node, NamedNode)]
    batches = [" ".join(named[at : at + _NAMED_AT_ONCE]) for at in range(0, len(named), _NAMED_AT_ONCE)]
    return batches, [node for node in terms if isinstance(node, BlankNode)]
