"""The triples of a SHACL shapes graph, read by property."""

from __future__ import annotations

from collections.abc import Iterable

from pyoxigraph import BlankNode, Literal, NamedNode, Triple

from irtwin.errors import InputError
from irtwin.knowledge.vocabulary import SH, shorten

Node = NamedNode | BlankNode | Literal | Triple


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

    def is_deactivated(self, node: object) -> bool:
        """Whether a shape or rule is switched off."""
        off = self.value(node, "deactivated")
        return isinstance(off, Literal) and off.value in ("true", "1")

    def fault(self, node: object, what: str) -> InputError:
        """Return the error of a shape that cannot be understood."""
        return InputError(f"{self.source}: {shorten(getattr(node, 'value', str(node)))}: {what}")
