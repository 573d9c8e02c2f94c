"""What axioms say of a term beyond links between names: definitions, restrictions and chains, in words."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pyoxigraph import BlankNode, Literal, NamedNode, Store, Triple

from irtwin.knowledge.vocabulary import OWL, RDF, RDFS, XSD

Word = NamedNode | str  # a term, or a word between terms
Node = NamedNode | BlankNode | Literal | Triple

_AXIOMS = {
    OWL + "equivalentClass": "equivalent to",
    RDFS + "subClassOf": "subclass of",
    RDFS + "range": "range",
    OWL + "propertyChainAxiom": "follows from",
}
_JOINED = {OWL + "intersectionOf": "and", OWL + "unionOf": "or", OWL + "oneOf": "or"}
_RESTRICTED = {OWL + "someValuesFrom": "some", OWL + "allValuesFrom": "only", OWL + "hasValue": "is"}
_COUNTED = {
    OWL + "minCardinality": "at least",
    OWL + "maxCardinality": "at most",
    OWL + "cardinality": "exactly",
    OWL + "minQualifiedCardinality": "at least",
    OWL + "maxQualifiedCardinality": "at most",
    OWL + "qualifiedCardinality": "exactly",
}


def axioms(store: Store) -> Iterator[tuple[str, str, list[Word]]]:
    """Yield a term's IRI, which axiom it is, and what that says. Domains and unions of names are links already."""
    for predicate, name in _AXIOMS.items():
        for quad in store.quads_for_pattern(None, NamedNode(predicate), None, None):
            if not isinstance(quad.subject, NamedNode) or _is_link(store, name, quad.object):
                continue
            if name == "follows from":
                words = list(_between((_words(store, member) for member in _list(store, quad.object)), "then"))
            else:
                words = _words(store, quad.object)
            yield quad.subject.value, name, words


def _is_link(store: Store, name: str, node: Node) -> bool:
    """Whether `links.rq` tells it: a name, or the union of some."""
    union = isinstance(node, BlankNode) and _said(store, node).get(OWL + "unionOf")
    return name != "equivalent to" and (isinstance(node, NamedNode) or bool(union))


def _words(store: Store, node: Node, *, inner: bool = False) -> list[Word]:
    if isinstance(node, NamedNode):
        return [node]
    if isinstance(node, Literal):
        return [f'"{node.value}"' if node.datatype.value == XSD + "string" else node.value]
    if not isinstance(node, BlankNode):
        return ["…"]
    objects = _said(store, node)
    for operator, word in _JOINED.items():
        if operator in objects:
            members = _list(store, objects[operator])
            words = list(_between((_words(store, member, inner=True) for member in members), word))
            return ["(", *words, ")"] if inner else words
    if OWL + "complementOf" in objects:
        return ["not", *_words(store, objects[OWL + "complementOf"], inner=True)]
    return _restriction(store, objects)


def _restriction(store: Store, objects: dict[str, Node]) -> list[Word]:
    """Return a restriction's words; those of what it has no words for are dots."""
    if OWL + "inverseOf" in objects:
        return ["inverse of", *_words(store, objects[OWL + "inverseOf"])]
    property = _words(store, objects[OWL + "onProperty"]) if OWL + "onProperty" in objects else []
    for kind in objects.keys() & _RESTRICTED.keys():
        return [*property, _RESTRICTED[kind], *_words(store, objects[kind], inner=True)]
    for kind in objects.keys() & _COUNTED.keys():
        of = objects.get(OWL + "onClass", objects.get(OWL + "onDataRange"))
        counted = ["of", *_words(store, of, inner=True)] if of else []
        return [_COUNTED[kind], *_words(store, objects[kind]), *property, *counted]
    return ["…"]


def _between(parts: Iterable[list[Word]], word: str) -> Iterator[Word]:
    for number, part in enumerate(parts):
        if number:
            yield word
        yield from part


def _said(store: Store, node: Node) -> dict[str, Node]:
    return {quad.predicate.value: quad.object for quad in store.quads_for_pattern(node, None, None, None)}  # type: ignore[arg-type]


def _list(store: Store, node: Node) -> Iterator[Node]:
    while isinstance(node, BlankNode):
        objects = _said(store, node)
        yield objects[RDF + "first"]
        node = objects[RDF + "rest"]
