"""Does the graph keep the SHACL constraints of `rules/shapes.ttl`, of files that extend them, and of the ontology?

What was asserted is checked, before any conclusion: a type that follows from a domain is no proof of itself. Classes
are read as SHACL reads them: by the types that are said, and `rdfs:subClassOf` of the ontology, which is in the data.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache

import pyshacl
import rdflib
from pyoxigraph import BlankNode, NamedNode, Quad, RdfFormat, Triple, parse, serialize
from rdflib.namespace import SH

from irtwin.knowledge import parts
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.reasoning import asserted, content_name
from irtwin.knowledge.reasoning import made_of as reasoned_from
from irtwin.knowledge.shacl.of_ontology import SUB_CLASS_OF, with_ontology
from irtwin.knowledge.store.changes import DERIVED_FROM, nodes_of
from irtwin.knowledge.store.graph import KnowledgeGraph, in_graph, read_turtle
from irtwin.knowledge.vocabulary import (
    GRAPH_INFERRED,
    GRAPH_REASONED,
    GRAPH_VALIDATION,
    shorten,
)
from irtwin.resources import Files


@dataclass(frozen=True)
class Violation:
    """A node that breaks a constraint, said in words; `property` and `value` where the constraint has them.

    `robot` is the one that the node belongs to, None where it belongs to none, or to several.
    """

    node: str
    message: str
    property: str | None
    value: str | None
    robot: str | None = None

    def __str__(self) -> str:
        """Return one line: what is wrong, with which node, of which robot."""
        found = "" if self.property is None else f" ({shorten(self.property)} is {self.value or 'absent'})"
        of = "" if self.robot is None else f"{shorten(self.robot)}: "
        return f"{of}{shorten(self.node)}: {self.message}{found}"


def validate(graph: KnowledgeGraph) -> tuple[Violation, ...]:
    """Check the graph; return what breaks a constraint, and keep SHACL's report as a named graph.

    Only parts of the graph that changed since are checked again, if it was reasoned over in parts: see `parts`.
    """
    ontology = Ontology(graph)
    made_of = content_name(ontology.triples, graph.resources)
    changed = graph.changed(GRAPH_VALIDATION)
    in_parts = changed is not None and made_of == reasoned_from(graph) and not graph.changed(GRAPH_INFERRED)
    validated = Triple(NamedNode(GRAPH_VALIDATION), DERIVED_FROM, made_of)
    report = _again(graph, ontology, changed or set()) if in_parts and graph.holds(validated) else None
    if report is None:
        report = _report(asserted(graph), ontology, graph.resources.of("shapes"))
    text = report.serialize(format="nt", encoding="utf-8")
    graph.replace(
        in_graph((quad.triple for quad in parse(text, format=RdfFormat.N_TRIPLES)), GRAPH_VALIDATION), GRAPH_VALIDATION
    )
    graph.change(changed or (), in_graph([validated], GRAPH_REASONED) if in_parts else ())
    robots = _Robots(graph, ontology)
    return tuple(sorted((_violation(report, node, robots) for node in report.objects(None, SH.result)), key=str))


def _again(graph: KnowledgeGraph, ontology: Ontology, changed: set[Quad]) -> rdflib.Graph | None:
    """Return the report of before with that of the parts that changed; None where all is to be checked."""
    region = parts.around(graph, ontology, nodes_of(changed))
    if region is None or any(isinstance(node, BlankNode) for node in region.nodes):
        return None
    report = _as_rdflib(graph.triples(GRAPH_VALIDATION))
    (head,) = report.subjects(rdflib.RDF.type, SH.ValidationReport)
    nodes = {rdflib.URIRef(node.value) for node in region.nodes}
    for result in [one for one in report.objects(None, SH.result) if report.value(one, SH.focusNode) in nodes]:
        report -= report.cbd(result)
        report.remove((None, SH.result, result))
    if region.asserted:
        found = _report(ontology.triples | region.asserted, ontology, graph.resources.of("shapes"))
        for result in [one for one in found.objects(None, SH.result) if found.value(one, SH.focusNode) in nodes]:
            report += found.cbd(result)
            report.add((head, SH.result, result))
    report.set((head, SH.conforms, rdflib.Literal((head, SH.result, None) not in report)))
    return report


class _Robots:
    """Tells which robot a node belongs to, by the part of the graph that it is in."""

    def __init__(self, graph: KnowledgeGraph, ontology: Ontology):
        self._graph, self._ontology = graph, ontology
        self._known: dict[str, str | None] = {}

    def of(self, node: str) -> str | None:
        """Return a robot's IRI; None where the node is no robot's alone."""
        if node not in self._known:
            region = parts.around(self._graph, self._ontology, [NamedNode(node)])
            robots = [] if region is None else parts.robots(self._ontology, region.asserted)
            found = robots[0].value if len(robots) == 1 else None
            self._known |= dict.fromkeys([node, *(one.value for one in (region.nodes if region else ()))], found)
        return self._known[node]


def _report(data: Iterable[Triple], ontology: Ontology, files: Files) -> rdflib.Graph:
    report: rdflib.Graph
    shapes, unions = _shapes(frozenset(ontology.triples), files)
    _, report, _ = pyshacl.validate(_as_rdflib(unions.union(data)), shacl_graph=shapes)
    return report


@lru_cache(maxsize=1)
def _shapes(ontology: frozenset[Triple], files: Files) -> tuple[rdflib.Graph, frozenset[Triple]]:
    """Return the shapes, and what they have to find in the data: which classes are below unions of classes."""
    shapes = with_ontology((triple for file in files for triple in read_turtle(file.path)), ontology)
    return _as_rdflib(shapes), frozenset(triple for triple in shapes if triple.predicate == SUB_CLASS_OF)


def _as_rdflib(triples: Iterable[Triple]) -> rdflib.Graph:
    return rdflib.Graph().parse(data=serialize(triples, format=RdfFormat.N_TRIPLES), format="nt")


def _violation(report: rdflib.Graph, result: rdflib.term.Node, robots: _Robots) -> Violation:
    said = {name: report.value(result, SH[name]) for name in ("focusNode", "resultMessage", "resultPath", "value")}
    focus, path, value = said["focusNode"], said["resultPath"], said["value"]
    return Violation(
        node=str(focus),
        message=str(said["resultMessage"]),
        property=str(path) if isinstance(path, rdflib.URIRef) else None,
        value=None if value is None else str(value),
        robot=robots.of(str(focus)) if isinstance(focus, rdflib.URIRef) else None,
    )
