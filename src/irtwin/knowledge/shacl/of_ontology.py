"""SHACL shapes that the ontology itself tells: of domains, of ranges, of listed texts, and of catalogues.

A domain concludes a type in OWL; here it asks for one: what has a property of joints must be said to be a joint. A
class whose individuals stand in the ontology is a catalogue, such as effects and channels: there are no others. Nothing
of this is written twice; where a shape by hand asks for the class of a property's values, in better words, it stays.
Terms of other vocabularies, as their rdfs:isDefinedBy says, are left to these.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from itertools import chain
from typing import TypeGuard

from pyoxigraph import Literal, NamedNode, RdfFormat, Triple, parse

from irtwin.knowledge.shacl.shapes import Shapes
from irtwin.knowledge.store.by_subject import Node
from irtwin.knowledge.vocabulary import OWL, RDF, RDFS, SH, TYPE, shorten

_OWN = "https://w3id.org/irtwin/shapes/"
SUB_CLASS_OF = NamedNode(RDFS + "subClassOf")
_PROLOGUE = f"PREFIX sh: <{SH}> PREFIX rdf: <{RDF}> PREFIX rdfs: <{RDFS}>\n"
Classes = tuple[str, ...]  # IRIs; what is meant is of one of them


def with_ontology(by_hand: Iterable[Triple], ontology: Iterable[Triple]) -> set[Triple]:
    """Return shapes written by hand, their lists of catalogues closed, with those that an ontology tells.

    Among them stands which classes are below unions of classes; a SHACL engine looks for that in the data.
    """
    written = set(by_hand)
    terms = _Ontology(Shapes(ontology, "the ontology"), Shapes(written, "rules/shapes.ttl"))
    closed = {
        triple: Triple(triple.subject, NamedNode(SH + "in"), _name("members", triple.object.value))
        for triple in written
        if triple.predicate.value == SH + "class"
        and isinstance(triple.object, NamedNode)
        and triple.object.value in terms.catalogues
    }
    told = _PROLOGUE + "\n".join(chain(terms.domains(), terms.ranges(), terms.codes(), terms.members()))
    of_ontology = {quad.triple for quad in parse(told, format=RdfFormat.TURTLE)}
    return (written - closed.keys()).union(closed.values(), of_ontology)


class _Ontology:
    """What an ontology says of its properties and classes."""

    def __init__(self, statements: Shapes, by_hand: Shapes):
        self._said, self._by_hand = statements, by_hand
        self._classes = {kind for kind in statements.having(TYPE.value, OWL + "Class") if self._is_own(kind)}
        self.catalogues = {
            kind.value: individuals for kind in self._classes if (individuals := self._individuals(kind.value))
        }

    def domains(self) -> Iterator[str]:
        """Yield in Turtle that what has a property is said to be of its domain."""
        properties: dict[Classes, list[str]] = {}
        for name in self._properties("domain"):
            properties.setdefault(self._classes_of(name, "domain"), []).append(name)
        for classes, names in properties.items():
            message = f"is not said to be {self._named(classes)}, though only one has such properties"
            targets = ", ".join(f"<{name}>" for name in names)
            yield _shape("domain", classes, message, f"sh:targetSubjectsOf {targets} ; {_of_classes(classes)}")

    def ranges(self) -> Iterator[str]:
        """Yield that the values of a property are said to be of its range, where no shape by hand asks for more."""
        for name in self._properties("range"):
            classes = self._classes_of(name, "range")
            of_classes = classes and {NamedNode(kind) for kind in classes} <= self._classes
            if not of_classes or self._is_asked_by_hand(name):
                continue  # values that are literals, or asked for in better words
            members = [member for kind in classes for member in self.catalogues.get(kind, ())]
            message = f"{shorten(name)} leads to {self._named(classes)}{' of the ontology' if members else ''}"
            yield from _values(name, message, _one_of(classes, members) if members else _of_classes(classes))

    def codes(self) -> Iterator[str]:
        """Yield that a property whose range is a list of literals has one of these, and one alone if functional."""
        for name in self._properties("range"):
            codes = self._said.items(self._said.value(self._said.value(NamedNode(name), RDFS + "range"), OWL + "oneOf"))
            if not codes:
                continue
            *others, last = (f'"{getattr(code, "value", code)}"' for code in codes)
            message = f"{self._label(name)} is {' or '.join(filter(None, (', '.join(others), last)))}"
            is_functional = NamedNode(OWL + "FunctionalProperty") in self._said.values(NamedNode(name), TYPE.value)
            once = " ; sh:maxCount 1" if is_functional else ""
            yield from _values(name, message, f"sh:in ( {' '.join(map(str, codes))} ){once}")

    def members(self) -> Iterator[str]:
        """Yield that a catalogue has no individuals but those of the ontology."""
        for name, individuals in self.catalogues.items():
            message = f"is not in the ontology, which lists every {self._label(name)} ({shorten(name)})"
            yield _shape("catalogue", (name,), message, f"sh:targetClass <{name}> ; {_one_of((name,), individuals)}")

    def _properties(self, end: str) -> list[str]:
        return sorted(node.value for node in self._said.having(RDFS + end) if self._is_own(node))

    def _is_own(self, term: Node) -> TypeGuard[NamedNode]:
        """Whether a term has a name, and is not of a vocabulary that the ontology has no module of."""
        home = self._said.value(term, RDFS + "isDefinedBy")
        named = isinstance(term, NamedNode)
        return named and (home is None or NamedNode(OWL + "Ontology") in self._said.values(home, TYPE.value))

    def _classes_of(self, name: str, end: str) -> Classes:
        """Return the classes that a property's domain or range is, or is the union of."""
        cell_or_class = self._said.value(NamedNode(name), RDFS + end)
        if isinstance(cell_or_class, NamedNode):
            return (cell_or_class.value,)
        members = self._said.items(self._said.value(cell_or_class, OWL + "unionOf"))
        return tuple(member.value for member in members if isinstance(member, NamedNode))

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
        return bool(subjects) and all(
            asked & self._said.reached(NamedNode(subject), SUB_CLASS_OF.value) for subject in subjects
        )

    def _individuals(self, name: str) -> list[str]:
        """Return the individuals that the ontology says of a class; of classes below as well where it says any."""
        if not self._said.having(TYPE.value, name):
            return []
        below = [kind for kind in self._classes if NamedNode(name) in self._said.reached(kind, SUB_CLASS_OF.value)]
        individuals = (node for kind in below for node in self._said.having(TYPE.value, kind.value))
        return sorted({str(individual.value) for individual in individuals})  # type: ignore[union-attr]

    def _named(self, classes: Classes) -> str:
        return " or ".join(f"{_article(self._label(kind))} {self._label(kind)} ({shorten(kind)})" for kind in classes)

    def _label(self, name: str) -> str:
        return self._said.text(NamedNode(name), RDFS + "label") or shorten(name)


def _name(kind: str, *names: str) -> NamedNode:
    return NamedNode(_OWN + "/".join((kind, *(shorten(name).replace(":", "-") for name in names))))


def _shape(kind: str, names: Classes, message: str, constraint: str) -> str:
    return f"{_name(kind, *names)} a sh:NodeShape ; sh:message {Literal(message)} ; {constraint} ."


def _values(name: str, message: str, constraint: str) -> Iterator[str]:
    """Yield that the values of a property keep a constraint."""
    of_range, value = _name("range", name), _name("value", name)
    yield f"{of_range} a sh:NodeShape ; sh:targetSubjectsOf <{name}> ; sh:property {value} ."
    yield f"{value} sh:path <{name}> ; sh:message {Literal(message)} ; {constraint} ."


def _of_classes(classes: Classes) -> str:
    """Return that a value is of one of some classes: of their union, which each of them is below."""
    if len(classes) == 1:
        return f"sh:class <{classes[0]}>"
    union = _name("union", *classes)
    return f"sh:class {union} . " + " . ".join(f"<{kind}> rdfs:subClassOf {union}" for kind in classes)


def _one_of(classes: Classes, members: Sequence[str]) -> str:
    """Return that a value is one of some individuals, which a list with a name holds."""
    members_of = _name("members", *classes)
    first, *others = (f"<{member}>" for member in members)
    return f"sh:in {members_of} . {members_of} rdf:first {first} ; rdf:rest ( {' '.join(others)} )"


def _article(label: str) -> str:
    return "an" if label[:1].lower() in "aeiou" else "a"
