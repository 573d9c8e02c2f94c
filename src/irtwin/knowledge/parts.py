"""The graph in parts: what individuals of one part say together bears on no other part.

All parts have the ontology in common: its triples, and the terms that they speak of. Any other subject or object, but
for literals and classes, is a node of one part: a robot with its joints, runs and twins is one.

A conclusion is drawn from facts that rules join by common nodes. Those of one part are joined by a node of that part or
through the ontology, so what is concluded of all parts is what is concluded of each beside the ontology, as long as

- a part says nothing of the ontology's terms alone, and nothing leads from one of these to a node of a part;
- a part does not model: no subclasses, properties, equalities, lists, keys or datatypes of its own;
- a part has nothing from the ontology, and no literal, for object of an inverse functional property or of a predicate
  that rules follow backward, and no predicate that rules look for anywhere (see `locality`).

`join` finds a statement that is against this, and then the graph is one part. It is asked of all that is concluded.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

from pyoxigraph import BlankNode, Literal, NamedNode, Quad, Triple

from irtwin.knowledge import locality
from irtwin.knowledge.owl_rl import datatypes
from irtwin.knowledge.owl_rl.closure import Closure, show
from irtwin.knowledge.owl_rl.program import program
from irtwin.knowledge.owl_rl.terms import Node
from irtwin.knowledge.store.changes import is_asserted
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_INFERRED, GRAPH_ONTOLOGY, GRAPH_REASONED, OWL, RDF, term

Name = NamedNode | BlankNode

_TYPE = NamedNode(RDF + "type")
_INVERSE_FUNCTIONAL = NamedNode(OWL + "InverseFunctionalProperty")
_ROBOT = NamedNode(term("Industrial_Robot"))
_HAS_KEY = NamedNode(OWL + "hasKey")


class Ontology:
    """What all parts have in common."""

    def __init__(self, graph: KnowledgeGraph):
        self.resources = graph.resources
        self.triples = graph.triples(GRAPH_ONTOLOGY)
        self.terms: set[object] = {term for triple in self.triples for term in triple}
        self.terms.update(map(NamedNode, locality.of_all_rules(graph.resources).terms))

    def nodes(self, triple: Triple) -> list[Name]:
        """Return the nodes of parts that a triple speaks of."""
        ends = (triple.subject,) if triple.predicate == _TYPE else (triple.subject, triple.object)
        return [end for end in ends if isinstance(end, NamedNode | BlankNode) and end not in self.terms]


@dataclass
class Region:
    """Some parts of the graph: their nodes, what is asserted of them, and what was concluded of them before."""

    nodes: set[Name] = field(default_factory=set)
    asserted: set[Triple] = field(default_factory=set)
    concluded: set[Quad] = field(default_factory=set)


def around(graph: KnowledgeGraph, ontology: Ontology, seeds: Iterable[Name]) -> Region | None:
    """Return the parts that the seeds belong to, or None where one is a term that more is said of than the ontology."""
    region, todo = Region(), list(seeds)
    while todo:
        node = todo.pop()
        if node in ontology.terms:
            if any(is_asserted(it) and it.subject == node and _elsewhere(it) for it in graph.about(node)):
                return None
        elif node not in region.nodes:
            region.nodes.add(node)
            for quad in graph.about(node):
                if is_asserted(quad):
                    region.asserted.add(quad.triple)
                elif quad.graph_name.value.startswith((GRAPH_INFERRED, GRAPH_REASONED)):  # type: ignore[union-attr]
                    region.concluded.add(quad)
                else:
                    continue
                if quad.graph_name.value != GRAPH_REASONED:  # type: ignore[union-attr]
                    todo += ontology.nodes(quad.triple)
    return region


def parted(ontology: Ontology, triples: Iterable[Triple]) -> Callable[[Name], Name]:
    """Return a function that tells nodes' parts: one node stands for all of a part."""
    above: dict[Name, Name] = {}

    def top(node: Name) -> Name:
        while (next_one := above.setdefault(node, node)) != node:
            above[node] = node = above[next_one]
        return node

    for triple in triples:
        nodes = ontology.nodes(triple)
        if len(nodes) == 2:
            above[top(nodes[0])] = top(nodes[1])
    return top


def groups(ontology: Ontology, triples: Iterable[Triple]) -> tuple[set[Triple], list[set[Triple]]]:
    """Return what is said of no part, and what is said of each."""
    said = list(triples)
    part_of = parted(ontology, said)
    common, of_parts = set[Triple](), dict[Name, set[Triple]]()
    for triple in said:
        nodes = ontology.nodes(triple)
        (of_parts.setdefault(part_of(nodes[0]), set()) if nodes else common).add(triple)
    return common, sorted(of_parts.values(), key=lambda part: min(map(str, part)))


def robots(ontology: Ontology, part: Iterable[Triple]) -> list[Name]:
    """Return the robots of a part."""
    found = {node for one in part if (one.predicate, one.object) == (_TYPE, _ROBOT) for node in ontology.nodes(one)}
    return sorted(found, key=str)


def spoken_for(ontology: Ontology, part: Iterable[Triple]) -> list[Name]:
    """Return who stands for a part: its robots; where it has none, its first node."""
    said = list(part)
    return robots(ontology, said) or [min((node for one in said for node in ontology.nodes(one)), key=str)]


def join(ontology: Ontology, closure: Closure, count: int) -> str | None:
    """Return a statement that may bear on several parts, in words; None where there is none.

    closure: of the ontology, `count` statements, and then of some parts.
    """
    reach = locality.of_all_rules(ontology.resources)
    if reach.unknown:
        return min(reach.unknown)
    if any(predicate == _HAS_KEY for _, predicate, _ in closure.since(0)):
        return "owl:hasKey"
    properties, classes = program().terms_of_models()
    backward: set[object] = {NamedNode(iri) for iri in reach.backward}
    backward |= {one for one, predicate, kind in closure.since(0) if (predicate, kind) == (_TYPE, _INVERSE_FUNCTIONAL)}
    forbidden = {NamedNode(iri) for iri in properties | reach.anywhere}
    kinds = {NamedNode(iri) for iri in classes}
    for subject, predicate, object in closure.since(count):
        if isinstance(subject, Literal):
            joins = not (predicate == _TYPE and _is_datatype(object))  # of a value, the same holds in every part
        elif subject in ontology.terms:
            joins = True
        elif predicate == _TYPE:
            joins = object in kinds
        else:
            outside = object in ontology.terms or isinstance(object, Literal)
            joins = predicate in forbidden or (outside and predicate in backward)
        if joins or any(_is_datatype(end) and end not in ontology.terms for end in _ends(subject, object)):
            return " ".join(map(show, (subject, predicate, object)))
    return None


def _ends(subject: Node, object: Node) -> tuple[Node, ...]:
    """Return where a part could speak of a datatype that the ontology does not: all parts would be told of it."""
    return () if isinstance(subject, Literal) else (subject, object)


def _is_datatype(term: Node) -> bool:
    return isinstance(term, NamedNode) and datatypes.is_datatype(term.value)


def _elsewhere(quad: Quad) -> bool:
    return isinstance(quad.graph_name, NamedNode) and quad.graph_name.value != GRAPH_ONTOLOGY
