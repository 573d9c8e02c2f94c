"""Does the graph keep the SHACL constraints of `rules/shapes.ttl`?"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import pyshacl
import rdflib
from pyoxigraph import RdfFormat, parse, serialize
from rdflib.namespace import SH

from irtwin.knowledge.graph import KnowledgeGraph, in_graph
from irtwin.knowledge.vocabulary import GRAPH_VALIDATION, shorten
from irtwin.resources import folder


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
    """Check the whole graph; return what breaks a constraint, and keep SHACL's report as a named graph."""
    graph.replace([], GRAPH_VALIDATION)
    data = rdflib.Graph().parse(data=serialize(graph.triples(), format=RdfFormat.N_TRIPLES), format="nt")
    _, report, _ = pyshacl.validate(data, shacl_graph=_shapes())
    text = report.serialize(format="nt", encoding="utf-8")
    graph.replace(
        in_graph((quad.triple for quad in parse(text, format=RdfFormat.N_TRIPLES)), GRAPH_VALIDATION), GRAPH_VALIDATION
    )
    return tuple(sorted((_violation(report, node) for node in report.objects(None, SH.result)), key=str))


@cache
def _shapes() -> rdflib.Graph:
    return rdflib.Graph().parse(folder("rules") / "shapes.ttl")


def _violation(report: rdflib.Graph, result: rdflib.term.Node) -> Violation:
    said = {name: report.value(result, SH[name]) for name in ("focusNode", "resultMessage", "resultPath", "value")}
    path, value = said["resultPath"], said["value"]
    return Violation(
        node=str(said["focusNode"]),
        message=str(said["resultMessage"]),
        property=str(path) if isinstance(path, rdflib.URIRef) else None,
        value=None if value is None else str(value),
    )
