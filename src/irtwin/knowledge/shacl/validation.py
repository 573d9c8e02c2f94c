"""Does the graph keep the SHACL constraints of `rules/shapes.ttl`, and of files that extend them?"""

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
from irtwin.knowledge.reasoning import content_name
from irtwin.knowledge.reasoning import made_of as reasoned_from
from irtwin.knowledge.store.changes import DERIVED_FROM, nodes_of
from irtwin.knowledge.store.graph import KnowledgeGraph, in_graph, read_turtle
from irtwin.knowledge.vocabulary import (
    GRAPH_CHANGED,
    GRAPH_INFERRED,
    GRAPH_ONTOLOGY,
    GRAPH_REASONED,
    GRAPH_VALIDATION,
    shorten,
)
from irtwin.resources import Files

_OF_ONTOLOGY = f"""
CONSTRUCT {{ ?s ?p ?o }}
WHERE {{
  {{ SELECT DISTINCT ?s {{ GRAPH <{GRAPH_ONTOLOGY}> {{ ?s ?_p ?_o }} }} }}
  GRAPH ?g {{ ?s ?p ?o }}
  FILTER(STRSTARTS(STR(?g), "{GRAPH_INFERRED}"))
}}"""


@dataclass(frozen=True)
class Violation:
    """A node that breaks a constraint, said in words; `property` and `value` where the constraint has them."""

    node: str
    message: str
    property: str | None
    value: str | None

    def __str__(self) -> str:
        """Return one line: what is wrong, with which node."""
        found = "" if self.property is None else f" ({shorten(self.property)} is {self.value or 'absent'})"
        return f"{shorten(self.node)}: {self.message}{found}"


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
        names = [
            name for name in graph.graphs() if not name.startswith((GRAPH_VALIDATION, GRAPH_REASONED, GRAPH_CHANGED))
        ]
        report = _report(graph.triples(*names) if names else (), graph.resources.of("shapes"))
    text = report.serialize(format="nt", encoding="utf-8")
    graph.replace(
        in_graph((quad.triple for quad in parse(text, format=RdfFormat.N_TRIPLES)), GRAPH_VALIDATION), GRAPH_VALIDATION
    )
    graph.change(changed or (), in_graph([validated], GRAPH_REASONED) if in_parts else ())
    return tuple(sorted((_violation(report, node) for node in report.objects(None, SH.result)), key=str))


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
        known = ontology.triples | graph.construct(_OF_ONTOLOGY) | region.asserted
        found = _report(known | {quad.triple for quad in region.concluded}, graph.resources.of("shapes"))
        for result in [one for one in found.objects(None, SH.result) if found.value(one, SH.focusNode) in nodes]:
            report += found.cbd(result)
            report.add((head, SH.result, result))
    report.set((head, SH.conforms, rdflib.Literal((head, SH.result, None) not in report)))
    return report


def _report(triples: Iterable[Triple], shapes: Files) -> rdflib.Graph:
    report: rdflib.Graph
    _, report, _ = pyshacl.validate(_as_rdflib(triples), shacl_graph=_shapes(shapes))
    return report


def _as_rdflib(triples: Iterable[Triple]) -> rdflib.Graph:
    return rdflib.Graph().parse(data=serialize(triples, format=RdfFormat.N_TRIPLES), format="nt")


@lru_cache(maxsize=16)
def _shapes(files: Files) -> rdflib.Graph:
    return _as_rdflib({triple for file in files for triple in read_turtle(file.path)})


def _violation(report: rdflib.Graph, result: rdflib.term.Node) -> Violation:
    said = {name: report.value(result, SH[name]) for name in ("focusNode", "resultMessage", "resultPath", "value")}
    path, value = said["resultPath"], said["value"]
    return Violation(
        node=str(said["focusNode"]),
        message=str(said["resultMessage"]),
        property=str(path) if isinstance(path, rdflib.URIRef) else None,
        value=None if value is None else str(value),
    )
