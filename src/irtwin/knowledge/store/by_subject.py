"""Triples of a document, looked up by subject and property."""

from __future__ import annotations

from collections.abc import Iterable

from pyoxigraph import BlankNode, Literal, NamedNode, Triple

from irtwin.knowledge.vocabulary import RDF

Node = NamedNode | BlankNode | Literal | Triple


class BySubject:
    """Triples by subject and property, in the order in which they come, each once.

    A property is given by its name in one namespace, or by its whole IRI.
    """

    def __init__(self, triples: Iterable[Triple], namespace: str) -> None:
        self._namespace = namespace
        self._objects: dict[Node, dict[str, list[Node]]] = {}
        self._having: dict[str, dict[Node, None]] = {}
        for triple in triples:
            values = self._objects.setdefault(triple.subject, {}).setdefault(triple.predicate.value, [])
            self._having.setdefault(triple.predicate.value, {})[triple.subject] = None
            if triple.object not in values:
                values.append(triple.object)

    def all(self) -> list[Node]:
        """Return all subjects."""
        return list(self._objects)

    def having(self, name: str, value: str | None = None) -> list[Node]:
        """Return the subjects that have a property, by its whole IRI; with that value, an IRI, if one is given."""
        wanted = None if value is None else NamedNode(value)
        subjects = self._having.get(name, {})
        return [subject for subject in subjects if wanted is None or wanted in self._objects[subject][name]]

    def said_of(self, node: Node | None) -> list[tuple[str, list[Node]]]:
        """Return all properties of a node, by their whole IRIs, with their values."""
        return list(self._objects.get(node, {}).items())  # type: ignore[arg-type]

    def values(self, node: Node | None, name: str) -> list[Node]:
        """Return the values of a property."""
        iri = name if ":" in name else self._namespace + name
        return self._objects.get(node, {}).get(iri, [])  # type: ignore[arg-type]

    def value(self, node: Node | None, name: str) -> Node | None:
        """Return the first value of a property, or None."""
        return next(iter(self.values(node, name)), None)

    def text(self, node: Node | None, name: str) -> str:
        """Return the text of a property's value; an empty one where it has none, or is no literal."""
        literal = self.value(node, name)
        return literal.value if isinstance(literal, Literal) else ""

    def reached(self, node: Node, name: str) -> set[Node]:
        """Return a node, and all that a property leads to from it, step by step."""
        reached, todo = set[Node](), [node]
        while todo:
            if (one := todo.pop()) not in reached:
                reached.add(one)
                todo += self.values(one, name)
        return reached

    def items(self, cell: Node | None) -> list[Node]:
        """Return the members of a list, by its first cell; none of what is no list that ends."""
        members, seen = list[Node](), set[Node]()
        while cell not in seen and cell is not None and (first := self.value(cell, RDF + "first")) is not None:
            seen.add(cell)
            members.append(first)
            cell = self.value(cell, RDF + "rest")
        return members if cell == NamedNode(RDF + "nil") else []
