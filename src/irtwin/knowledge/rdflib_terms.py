"""RDF terms between Oxigraph and rdflib, whose parsers and engines have terms of their own; none is normalised."""

from __future__ import annotations

from typing import Any

import rdflib
from pyoxigraph import BlankNode, Literal, NamedNode


def to_rdflib(term: Any) -> rdflib.term.Node:
    """Return Oxigraph's IRI, blank node or literal as rdflib has it."""
    if isinstance(term, NamedNode):
        return rdflib.URIRef(term.value)
    if isinstance(term, BlankNode):
        return rdflib.BNode(term.value)
    assert isinstance(term, Literal)
    if term.language:
        return rdflib.Literal(term.value, lang=term.language)
    return rdflib.Literal(term.value, datatype=rdflib.URIRef(term.datatype.value), normalize=False)


def from_rdflib(term: Any) -> Any:
    """Return rdflib's IRI, blank node or literal as Oxigraph has it; None of a variable or property path."""
    if isinstance(term, rdflib.URIRef):
        return NamedNode(str(term))
    if isinstance(term, rdflib.BNode):
        return BlankNode(str(term))
    if not isinstance(term, rdflib.Literal):
        return None
    datatype = None if term.datatype is None else NamedNode(str(term.datatype))
    return Literal(str(term), language=term.language) if term.language else Literal(str(term), datatype=datatype)
