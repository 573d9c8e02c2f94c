"""SHACL shapes that the ontology itself tells: of domains, of ranges, and of catalogues.

A domain concludes a type in OWL; here it asks for one: what has a property of joints must be said to be a joint. A
class whose individuals stand in the ontology is a catalogue, such as effects and channels: there are no others. Nothing
of this is written twice; where a shape by hand asks for the class of a property's values, in better words, it stays.
Terms of other vocabularies, as their rdfs:isDefinedBy says, are left to these.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TypeGuard

from pyoxigraph import BlankNode, Literal, NamedNode, Triple

from irtwin.knowledge.shacl.shapes import Shapes
from irtwin.knowledge.vocabulary import OWL, RDF, RDFS, SH, shorten

_OWN = "https://w3id.org/irtwin/shapes/"
_TYPE = RDF + "type"
SUB_CLASS_OF = NamedNode(RDFS + "subClassOf")
Classes = tuple[str, ...]  # IRIs; what is meant is of one of them
Term = NamedNode | BlankNode | Literal


def with_ontology(by_hand: Iterable[Triple], ontology: Iterable[Triple]) -> set[Triple]:
    """Return shapes written by hand, their lists of catalogues closed, with those that an ontology tells.

    Among them stands which classes are below unions of classes; a SHACL engine looks for that in the data.
    """
    written = set(by_hand)
    terms = _Ontology(Shapes(ontology, "the ontology"), Shapes(written, "rules/shapes.ttl"))
    closed = {
        triple: set(_one_of(triple.subject, terms.catalogues[triple.object.value]))
        for triple in written
        if triple.predicate.value == SH + "class"
        and isinstance(triple.object, NamedNode)
        and triple.object.value in terms.catalogues
    }
    return (written - closed.keys()).union(terms.domains(), terms.ranges(), terms.members(), *closed.values())


class _Ontology:
    """What an ontology says of its properties and classes."""

    def __init__(self, said: Shapes, by_hand: Shapes):
        self._said, self._by_hand = said, by_hand
        self._classes = {one for one in said.having(_TYPE, OWL + "Class") if self._is_own(one)}
        self.catalogues = {
            one.value: individuals for one in self._classes if (individuals := self._individuals(one.value))
        }

    def domains(self) -> Iterator[Triple]:
        """Yield that what has a property is said to be of its domain."""
        properties: dict[Classes, list[str]] = {}
        for name in self._properties("domain"):
            properties.setdefault(self._classes_of(name, "domain"), []).append(name)
        for classes, names in properties.items():
            shape = _shape("domain", *classes)
            yield from _is(shape, f"is not said to be {self._named(classes)}, though only one has such properties")
            yield from (_triple(shape, "targetSubjectsOf", NamedNode(name)) for name in names)
            yield from _of_classes(shape, classes)

    def ranges(self) -> Iterator[Triple]:
        """Yield that the values of a property are said to be of its range, where no shape by hand asks for more."""
        for name in self._properties("range"):
            classes = self._classes_of(name, "range")
            if not {NamedNode(one) for one in classes} <= self._classes or self._is_asked_by_hand(name):
                continue  # values that are literals, or asked for in better words
            members = [each for one in classes for each in self.catalogues.get(one, ())]
            shape, value = _shape("range", name), _shape("value", name)
            message = f"{shorten(name)} leads to {self._named(classes)}{' of the ontology' if members else ''}"
            yield Triple(shape, NamedNode(_TYPE), NamedNode(SH + "NodeShape"))
            yield _triple(shape, "targetSubjectsOf", NamedNode(name))
            yield _triple(shape, "property", value)
            yield _triple(value, "path", NamedNode(name))
            yield _triple(value, "message", Literal(message))
            yield from _one_of(value, members) if members else _of_classes(value, classes)

    def members(self) -> Iterator[Triple]:
        """Yield that a catalogue has no individuals but those of the ontology."""
        for name, individuals in self.catalogues.items():
            shape = _shape("catalogue", name)
            yield from _is(shape, f"is not in the ontology, which lists every {self._label(name)} ({shorten(name)})")
            yield _triple(shape, "targetClass", NamedNode(name))
            yield from _one_of(shape, individuals)

    def _properties(self, end: str) -> list[str]:
        return sorted(one.value for one in self._said.having(RDFS + end) if self._is_own(one))

    def _is_own(self, term: object) -> TypeGuard[NamedNode]:
        """Whether a term has a name, and is not of a vocabulary that the ontology has no module of."""
        home = self._said.value(term, RDFS + "isDefinedBy")
        named = isinstance(term, NamedNode)
        return named and (home is None or NamedNode(OWL + "Ontology") in self._said.values(home, _TYPE))

    def _classes_of(self, name: str, end: str) -> Classes:
        """Return the classes that a property's domain or range is, or is the union of."""
        cell_or_class = self._said.value(NamedNode(name), RDFS + end)
        if isinstance(cell_or_class, NamedNode):
            return (cell_or_class.value,)
        classes, cell = list[str](), self._said.value(cell_or_class, OWL + "unionOf")
        while isinstance(first := self._said.value(cell, RDF + "first"), NamedNode):
            classes.append(first.value)
            cell = self._said.value(cell, RDF + "rest")
        return tuple(classes)

    def _is_asked_by_hand(self, name: str) -> bool:
        """Whether shapes by hand ask for the class of a property's values, of all that may have the property."""
        asked = {
            target
            for shape in self._by_hand.having(SH + "property")
            for value in self._by_hand.values(shape, "property")
            if NamedNode(name) in self._by_hand.values(value, "path") and self._by_hand.values(value, "class")
            for target in self._by_hand.values(shape, "targetClass")
        }
        subjects = self._classes_of(name, "domain")
        return bool(subjects) and all(asked & self._above(NamedNode(one)) for one in subjects)

    def _above(self, one: object) -> set[object]:
        """Return a class with those that it is below of."""
        above, todo = set[object](), [one]
        while todo:
            each = todo.pop()
            if each not in above:
                above.add(each)
                todo += self._said.values(each, SUB_CLASS_OF.value)
        return above

    def _individuals(self, name: str) -> list[str]:
        """Return the individuals that the ontology says of a class; of classes below as well where it says any."""
        if not self._said.having(_TYPE, name):
            return []
        below = [one for one in self._classes if NamedNode(name) in self._above(one)]
        return sorted({str(each.value) for one in below for each in self._said.having(_TYPE, one.value)})  # type: ignore[union-attr]

    def _named(self, classes: Classes) -> str:
        return " or ".join(f"{_article(self._label(one))} {self._label(one)} ({shorten(one)})" for one in classes)

    def _label(self, name: str) -> str:
        label = self._said.value(NamedNode(name), RDFS + "label")
        return label.value if isinstance(label, Literal) else shorten(name)


def _shape(kind: str, *names: str) -> NamedNode:
    return NamedNode(_OWN + "/".join((kind, *(shorten(name).replace(":", "-") for name in names))))


def _is(shape: NamedNode, message: str) -> Iterator[Triple]:
    yield Triple(shape, NamedNode(_TYPE), NamedNode(SH + "NodeShape"))
    yield _triple(shape, "message", Literal(message))


def _triple(shape: NamedNode | BlankNode, name: str, value: Term) -> Triple:
    return Triple(shape, NamedNode(SH + name), value)


def _of_classes(shape: NamedNode, classes: Classes) -> Iterator[Triple]:
    """Yield that a value is of one of some classes: of their union, which each of them is below."""
    union = NamedNode(classes[0]) if len(classes) == 1 else _shape("union", *classes)
    yield _triple(shape, "class", union)
    for one in classes[1:] and classes:
        yield Triple(NamedNode(one), SUB_CLASS_OF, union)


def _one_of(shape: NamedNode | BlankNode | Triple, members: Sequence[str]) -> Iterator[Triple]:
    """Yield that a value is one of some individuals."""
    assert not isinstance(shape, Triple)
    return _list(shape, "in", [NamedNode(one) for one in members])


def _list(shape: NamedNode | BlankNode, name: str, items: Sequence[Term]) -> Iterator[Triple]:
    cells: list[NamedNode | BlankNode] = [BlankNode() for _ in items]
    ends = [*cells, NamedNode(RDF + "nil")]
    yield _triple(shape, name, ends[0])
    for item, cell, rest in zip(items, cells, ends[1:], strict=True):
        yield Triple(cell, NamedNode(RDF + "first"), item)
        yield Triple(cell, NamedNode(RDF + "rest"), rest)


def _article(label: str) -> str:
    return "an" if label[:1].lower() in "aeiou" else "a"
