"""The triples of a SHACL shapes graph, read by property."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pyoxigraph import Literal, NamedNode, Triple

from irtwin.errors import InputError
from irtwin.knowledge.store.by_subject import BySubject, Node
from irtwin.knowledge.vocabulary import OWL, RDF, RDFS, SH, shorten

TARGETS = {  # what is true in SPARQL of what a shape targets, by property
    "targetClass": "$this rdf:type/rdfs:subClassOf* {}",
    "targetNode": "VALUES $this {{ {} }}",
    "targetSubjectsOf": "$this {} ?_any",
    "targetObjectsOf": "?_any {} $this",
}
_CLASSES = {NamedNode(RDFS + "Class"), NamedNode(OWL + "Class")}


class Shapes(BySubject):
    """The triples of a shapes graph; `source` names it in messages."""

    def __init__(self, triples: Iterable[Triple], source: str):
        super().__init__(sorted(triples, key=str), SH)
        self.source = source

    def targets(self, shape: Node) -> Iterator[tuple[str, Node]]:
        """Yield the targets of a shape, each after the name of its property; a shape that is a class has itself."""
        for name in TARGETS:
            yield from ((name, value) for value in self.values(shape, name))
        if _CLASSES.intersection(self.values(shape, RDF + "type")):
            yield "targetClass", shape

    def prefixes(self, node: Node) -> dict[str, str]:
        """Return the prefixes that a query's sh:prefixes declare, with their namespaces."""
        declared = (
            declaration
            for ontology in self.values(node, "prefixes")
            for declaration in self.values(ontology, "declare")
        )
        return {self.text(declaration, "prefix"): self.text(declaration, "namespace") for declaration in declared}

    def is_deactivated(self, node: Node) -> bool:
        """Whether a shape or rule is switched off."""
        off = self.value(node, "deactivated")
        return isinstance(off, Literal) and off.value in ("true", "1")

    def fault(self, node: Node, problem: str) -> InputError:
        """Return the error of a shape that cannot be understood."""
        return InputError(f"{self.source}: {shorten(getattr(node, 'value', str(node)))}: {problem}")
