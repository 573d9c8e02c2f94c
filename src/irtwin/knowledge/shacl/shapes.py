"""The triples of a SHACL shapes graph, read by property."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pyoxigraph import BlankNode, Literal, NamedNode, Triple

from irtwin.errors import InputError
from irtwin.knowledge.vocabulary import OWL, RDF, RDFS, SH, shorten

Node = NamedNode | BlankNode | Literal | Triple

_TARGETS = ("targetClass", "targetNode", "targetSubjectsOf", "targetObjectsOf")
_CLASSES = {NamedNode(RDFS + "Class"), NamedNode(OWL + "Class")}


class Shapes:
    """The triples of a shapes graph; `source` names it in messages."""

    def __init__(self, triples: Iterable[Triple], source: str):
        self.source = source
        self._objects: dict[object, dict[str, list[Node]]] = {}
        for triple in sorted(triples, key=str):
            self._objects.setdefault(triple.subject, {}).setdefault(triple.predicate.value, []).append(triple.object)

    def having(self, name: str, value: str | None = None) -> list[Node]:
        """Return the nodes that have a property, by its whole IRI; with that value, an IRI, if one is given."""
        return [
            subject  # type: ignore[misc]
            for subject, objects in self._objects.items()
            if name in objects and (value is None or NamedNode(value) in objects[name])
        ]

    def all(self) -> list[Node]:
        """Return all subjects."""
        return list(self._objects)  # type: ignore[arg-type]

    def said_of(self, node: object) -> list[tuple[str, list[Node]]]:
        """Return all properties of a node, by their whole IRIs, with their values."""
        return list(self._objects.get(node, {}).items())

    def values(self, node: object, name: str) -> list[Node]:
        """Return the values of a property of SHACL's, or of any by its whole IRI."""
        return self._objects.get(node, {}).get(name if ":" in name else SH + name, [])

    def value(self, node: object, name: str) -> Node | None:
        """Return the one value of a property, or None."""
        return next(iter(self.values(node, name)), None)

    def text(self, node: object, name: str) -> str:
        """Return the text of a property's value; an empty one where it has none, or is no literal."""
        literal = self.value(node, name)
        return literal.value if isinstance(literal, Literal) else ""

    def items(self, cell: object) -> list[Node]:
        """Return the members of a list, by its first cell."""
        members = []
        while (first := self.value(cell, RDF + "first")) is not None:
            members.append(first)
            cell = self.value(cell, RDF + "rest")
        return members

    def targets(self, shape: object) -> Iterator[tuple[str, Node]]:
        """Yield the targets of a shape, each after the name of its property; a shape that is a class has itself."""
        for name in _TARGETS:
            yield from ((name, value) for value in self.values(shape, name))
        if _CLASSES.intersection(self.values(shape, RDF + "type")):
            yield "targetClass", shape  # type: ignore[misc]

    def prefixes(self, node: object) -> dict[str, str]:
        """Return the prefixes that a query's sh:prefixes declare, with their namespaces."""
        declared = (it for ontology in self.values(node, "prefixes") for it in self.values(ontology, "declare"))
        return {self.text(it, "prefix"): self.text(it, "namespace") for it in declared}

    def is_deactivated(self, node: object) -> bool:
        """Whether a shape or rule is switched off."""
        off = self.value(node, "deactivated")
        return isinstance(off, Literal) and off.value in ("true", "1")

    def fault(self, node: object, what: str) -> InputError:
        """Return the error of a shape that cannot be understood."""
        return InputError(f"{self.source}: {shorten(getattr(node, 'value', str(node)))}: {what}")
