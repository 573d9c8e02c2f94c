"""Does the graph keep the SHACL constraints of `rules/shapes.ttl`, of files that extend them, and of the ontology?

What was asserted is checked, before any conclusion: a type that follows from a domain is no proof of itself. Classes
are read as SHACL reads them: by the types that are said, and `rdfs:subClassOf` of the ontology, which is in the data.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property, lru_cache
from itertools import chain

import pyshacl
import rdflib
from pyoxigraph import BlankNode, NamedNode, Quad, RdfFormat, Store, Triple, parse, serialize
from rdflib.namespace import SH

from irtwin.knowledge import parts
from irtwin.knowledge.conclusions import content_name
from irtwin.knowledge.garbage import seldom_collected
from irtwin.knowledge.parts import Joined, Ontology, Region
from irtwin.knowledge.reasoning import asserted
from irtwin.knowledge.reasoning import made_of as reasoned_from
from irtwin.knowledge.shacl.of_ontology import SUB_CLASS_OF, with_ontology
from irtwin.knowledge.shacl.suspects import any_suspect, queries
from irtwin.knowledge.store.changes import DERIVED_FROM, nodes_of
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.vocabulary import GRAPH_INFERRED, GRAPH_REASONED, GRAPH_VALIDATION, shorten
from irtwin.resources import Files

Results = Iterator[tuple[rdflib.term.Node, rdflib.Graph]]  # with what is said of each


@dataclass(frozen=True)
class Violation:
    """A node that breaks a constraint, said in words; `property` and `value` where the constraint has them.

    `several`: the property has more values than it may. `robot` is the one that the node belongs to, None where it
    belongs to none, or to several.
    """

    node: str
    message: str
    property: str | None
    value: str | None
    robot: str | None = None
    several: bool = False

    def __str__(self) -> str:
        """Return one line: what is wrong, with which node, of which robot."""
        fault = "has several values" if self.several else f"is {self.value or 'absent'}"
        of_property = "" if self.property is None else f" ({shorten(self.property)} {fault})"
        of = "" if self.robot is None else f"{shorten(self.robot)}: "
        return f"{of}{shorten(self.node)}: {self.message}{of_property}"


@seldom_collected()
def validate(graph: KnowledgeGraph) -> tuple[Violation, ...]:
    """Check the graph; return what breaks a constraint, and keep SHACL's report as a named graph.

    Only parts of the graph that changed since are checked again, if it was reasoned over in parts: see `parts`.
    """
    ontology = Ontology.of(graph)
    made_of = content_name(ontology.triples, graph.resources)
    changed = graph.changed(GRAPH_VALIDATION)
    in_parts = changed is not None and made_of == reasoned_from(graph) and not graph.changed(GRAPH_INFERRED)
    validated = Triple(NamedNode(GRAPH_VALIDATION), DERIVED_FROM, made_of)
    report = None
    if in_parts:
        with suppress(Joined):
            changed_since = changed if graph.holds(validated) else None
            report = _by_parts(graph, ontology, changed_since)
    if report is None:
        report = _report(ontology, frozenset(asserted(graph)))
    report = _empty() if report is None else report
    text = report.serialize(format="nt", encoding="utf-8")
    graph.replace(
        in_graph((quad.triple for quad in parse(text, format=RdfFormat.N_TRIPLES)), GRAPH_VALIDATION), GRAPH_VALIDATION
    )
    graph.change(changed or (), in_graph([validated], GRAPH_REASONED) if in_parts else ())
    robots = _robots(graph, ontology, report)
    return tuple(sorted((_violation(report, node, robots) for node in report.objects(None, SH.result)), key=str))


def _by_parts(graph: KnowledgeGraph, ontology: Ontology, changed: set[Quad] | None) -> rdflib.Graph:
    """Return the report of before with what is found in parts that changed, or that of all parts if None did.

    Raises Joined where all is to be checked.
    """
    report = _empty() if changed is None else _as_rdflib(graph.triples(GRAPH_VALIDATION))
    regions = (
        parts.every(graph, ontology)
        if changed is None
        else parts.some(graph, ontology, nodes_of(changed), asserted=True)
    )
    (head,) = report.subjects(rdflib.RDF.type, SH.ValidationReport)
    for some in parts.together(regions):
        for result in _about(report, parts.one(some).nodes):  # of before
            report -= report.cbd(result)
            report.remove((None, SH.result, result))
        for result, of_robot in _results(ontology, some):
            report += of_robot
            report.add((head, SH.result, result))
    report.set((head, SH.conforms, rdflib.Literal((head, SH.result, None) not in report)))
    return report


def _results(ontology: Ontology, regions: list[Region]) -> Results:
    """Yield what is found in some parts, results with what is said of them. Raises Joined for nodes without a name."""
    region = parts.one(regions)
    if any(isinstance(node, BlankNode) for node in region.nodes):
        raise Joined("a node without a name")
    if region.nodes and not region.asserted:
        return
    report = _report(ontology, frozenset(region.asserted))
    if report is not None:
        yield from ((result, report.cbd(result)) for result in _about(report, region.nodes or ontology.terms))


def _about(report: rdflib.Graph, nodes: Iterable[object]) -> list[rdflib.term.Node]:
    names = {rdflib.URIRef(node.value) for node in nodes if isinstance(node, NamedNode)}
    return [result for result in report.objects(None, SH.result) if report.value(result, SH.focusNode) in names]


def _empty() -> rdflib.Graph:
    """Return the report of a graph that keeps all constraints."""
    report, head = rdflib.Graph(), rdflib.BNode()
    report.add((head, rdflib.RDF.type, SH.ValidationReport))
    report.add((head, SH.conforms, rdflib.Literal(True)))
    return report


def _robots(graph: KnowledgeGraph, ontology: Ontology, report: rdflib.Graph) -> dict[str, str]:
    """Return the robots of a report's nodes, by their IRIs, where these are one robot's alone: in the same part."""
    focused = {NamedNode(str(node)) for node in report.objects(None, SH.focusNode) if isinstance(node, rdflib.URIRef)}
    robots: dict[str, str] = {}
    for region in parts.some(graph, ontology, focused - ontology.terms, asserted=True):
        assert region is not None  # for no term of the ontology was asked
        if len(own := parts.robots(ontology, region.asserted)) == 1:
            robots |= dict.fromkeys((node.value for node in region.nodes & focused), own[0].value)
    return robots


@lru_cache(maxsize=1)  # what was tried on a copy of the graph is done to the graph
def _report(ontology: Ontology, statements: frozenset[Triple]) -> rdflib.Graph | None:
    """Return what pySHACL finds beside the ontology; None without asking it where nothing is suspected."""
    shapes = _shapes(frozenset(ontology.triples), ontology.resources.of("shapes"))
    store, asked = shapes.store_of(ontology.triples | statements)
    if not any_suspect(store, asked):
        return None
    report: rdflib.Graph
    data = shapes.unions | ontology.triples | statements
    _, report, _ = pyshacl.validate(_as_rdflib(data), shacl_graph=shapes.graph)
    return report


class _Constraints:
    """The shapes; `unions`, what they have to find in the data: which classes are below unions."""

    def __init__(self, shapes: set[Triple]):
        self._shapes = shapes
        self._queries: dict[frozenset[Triple], tuple[str, ...]] = {}
        self.unions = {triple for triple in shapes if triple.predicate == SUB_CLASS_OF}

    @cached_property
    def graph(self) -> rdflib.Graph:
        """The shapes, for pySHACL."""
        return _as_rdflib(self._shapes)

    def store_of(self, data: Iterable[Triple]) -> tuple[Store, tuple[str, ...]]:
        """Return a store of data, and the queries for suspects in it: what it says of classes is part of them."""
        store = Store()
        store.extend(in_graph(chain(self.unions, data)))
        classes = frozenset(quad.triple for quad in store.quads_for_pattern(None, SUB_CLASS_OF, None, None))
        if classes not in self._queries:
            self._queries = {classes: tuple(queries(self._shapes, classes))}
        return store, self._queries[classes]


@lru_cache(maxsize=1)
def _shapes(ontology: frozenset[Triple], files: Files) -> _Constraints:
    return _Constraints(with_ontology((triple for file in files for triple in read_turtle(file.path)), ontology))


def _as_rdflib(triples: Iterable[Triple]) -> rdflib.Graph:
    return rdflib.Graph().parse(data=serialize(triples, format=RdfFormat.N_TRIPLES), format="nt")


def _violation(report: rdflib.Graph, result: rdflib.term.Node, robots: Mapping[str, str]) -> Violation:
    values = {name: report.value(result, SH[name]) for name in ("focusNode", "resultMessage", "resultPath", "value")}
    focus, path, value = values["focusNode"], values["resultPath"], values["value"]
    return Violation(
        node=str(focus),
        message=str(values["resultMessage"]),
        property=str(path) if isinstance(path, rdflib.URIRef) else None,
        value=None if value is None else str(value),
        robot=robots.get(str(focus)),
        several=report.value(result, SH.sourceConstraintComponent) == SH.MaxCountConstraintComponent,
    )
