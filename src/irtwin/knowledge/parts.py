"""The graph in parts: what individuals of one part say together bears on no other part.

All parts have the ontology in common: its triples, and the terms that they speak of. Any other subject or object, but
for literals and classes, is a node of one part: a robot with its joints, runs and twins is one. Cells, lines and plants
are nodes of the part of each robot in them, which their other robots are not.

What is concluded of a part, and which constraints it breaks, is what follows from it beside the ontology: a rule or
constraint sees one part at a time. Where something but the ontology says more of its terms, or models (subclasses,
properties, equalities, lists, keys of its own), or nodes have no name, the graph is one part.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property, lru_cache
from itertools import chain, islice
from typing import Any

import numpy as np
import numpy.typing as npt
from pyoxigraph import BlankNode, NamedNode, Quad, Triple

from irtwin.knowledge.owl_rl.program import program
from irtwin.knowledge.owl_rl.schema import Schema
from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import (
    GRAPH_CHANGED,
    GRAPH_INFERRED,
    GRAPH_MAPPED,
    GRAPH_ONTOLOGY,
    GRAPH_REASONED,
    GRAPH_VALIDATION,
    INTO_PLACES,
    OWL,
    PLACES,
    TYPE,
    term,
)
from irtwin.resources import Resources

Name = NamedNode | BlankNode
Row = tuple[Any, Any, Any, NamedNode]  # subject, predicate, object, and the named graph

MOST_TOGETHER = 20_000  # triples of small parts that are looked at together
MOST_KEPT = 100_000  # triples of parts that are kept for who asks next
_AT_ONCE = 500_000  # nodes that are looked up among those that are known

EQUALITIES = {NamedNode(OWL + name) for name in ("sameAs", "differentFrom")}
_ROBOT = NamedNode(term("Industrial_Robot"))
_ONTOLOGY = NamedNode(GRAPH_ONTOLOGY)
_NOT_PARTS = (GRAPH_VALIDATION, GRAPH_CHANGED, GRAPH_MAPPED)
_NOT_FOLLOWED = (GRAPH_REASONED, *_NOT_PARTS)
_ASSERTED, _CONCLUDED, _NOTED, _APART = "asserted", "concluded", "noted", "apart"
_NAMES = (NamedNode, BlankNode)


class Joined(Exception):
    """A part bears on others: by what, in words."""


class Ontology:
    """What all parts have in common. Two of the same triples, rules and shapes are equal."""

    def __init__(self, graph: KnowledgeGraph):
        self.resources = graph.resources
        self.triples = graph.triples(GRAPH_ONTOLOGY)
        self.terms: set[object] = {term for triple in self.triples for term in triple}
        self.terms.update(NamedNode(rule.name) for rule in all_rules(graph.resources) if rule.name != rule.label)

    @classmethod
    def of(cls, graph: KnowledgeGraph) -> Ontology:
        """Return a graph's ontology; of a graph in a folder the same one until something is asserted."""
        known: Ontology | None = graph.read.get("ontology")
        if known is None or graph.folder is None:
            known = graph.read["ontology"] = cls(graph)
        return known

    @cached_property
    def _content(self) -> tuple[frozenset[Triple], Resources]:
        return frozenset(self.triples), self.resources

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Ontology) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @cached_property
    def schema(self) -> Schema:
        """The ontology, closed. Contradiction where it contradicts itself."""
        return _schema(self._content[0])

    @cached_property
    def models(self) -> tuple[set[NamedNode], set[NamedNode]]:
        """The properties and the classes by whose use a part would say what is to be concluded of others."""
        properties, classes = (set(map(NamedNode, some)) for some in program().terms_of_models())
        return properties - EQUALITIES, classes

    def nodes(self, triple: Triple) -> list[Name]:
        """Return the nodes of parts that a triple speaks of."""
        alone = triple.predicate == TYPE or triple.predicate in INTO_PLACES
        ends = (triple.subject,) if alone else (triple.subject, triple.object)
        return [end for end in ends if isinstance(end, NamedNode | BlankNode) and end not in self.terms]


@dataclass
class Region:
    """Some parts of the graph: their nodes, what is asserted of them, and what was concluded of them before."""

    nodes: set[Name] = field(default_factory=set)
    places: set[Name] = field(default_factory=set)
    asserted: set[Triple] = field(default_factory=set)
    concluded: set[Quad] = field(default_factory=set)

    def take(self, rows: Iterable[Row], ontology: Ontology) -> set[Name]:
        """Take in quads; return the nodes of parts that are their objects."""
        terms, names, places = ontology.terms, set[Name](), dict[NamedNode, str]()
        for subject, predicate, object, graph in rows:
            place = places.get(graph)
            if place is None:
                place = places.setdefault(graph, _place(graph.value))
            if place == _ASSERTED:
                self.asserted.add(Triple(subject, predicate, object))
                if object in PLACES and predicate == TYPE:
                    self.places.add(subject)
            elif place == _APART:
                continue
            else:
                self.concluded.add(Quad(subject, predicate, object, graph))
                if place == _NOTED:
                    continue
            if type(object) in _NAMES and predicate != TYPE and object not in terms:
                names.add(object)
        return names


def around(graph: KnowledgeGraph, ontology: Ontology, seeds: Iterable[Name]) -> Region | None:
    """Return the parts that the seeds belong to, or None where one is a term that more is said of than the ontology."""
    region, todo = Region(), set(seeds)
    terms = todo & ontology.terms
    if any(map(_says_more, graph.store.said_of(terms))):
        return None
    todo -= terms
    from_below = set(todo)
    while todo:
        region.nodes |= todo
        nodes = region.take(graph.store.said_of(todo), ontology)
        before = graph.store.leading_to(todo - region.places | todo & from_below, _NOT_FOLLOWED)
        from_below = before
        nodes |= region.take((row for row in graph.store.said_of(before & ontology.terms) if row[2] in todo), ontology)
        todo = (nodes | before - ontology.terms) - region.nodes
    return region


def some(
    graph: KnowledgeGraph, ontology: Ontology, seeds: Iterable[Name], *, asserted: bool = False
) -> Iterator[Region | None]:
    """Yield the parts that the seeds belong to, one by one, like `around`.

    asserted: what was concluded of them is not needed, so those that were read last may be given again.
    """
    wanted, done = set(seeds), set[Name]()
    for seed in sorted(wanted, key=str):
        if seed not in done:
            region = _recent(graph).get(seed) if asserted else None
            region = region or around(graph, ontology, [seed])
            if region is None:
                yield None
                return
            done |= region.nodes & wanted
            if region.nodes:  # none are around a term of the ontology
                yield region
                if sum(len(kept.asserted) for kept in _recent(graph).values()) < MOST_KEPT:
                    _recent(graph)[seed] = region


def _recent(graph: KnowledgeGraph) -> dict[Name, Region]:
    """Return parts that were read lately, each by a node of it, if nothing was asserted meanwhile."""
    recent: dict[Name, Region] = graph.read.setdefault("parts", {})
    return recent


def every(graph: KnowledgeGraph, ontology: Ontology) -> Iterator[Region | None]:
    """Yield the ontology alone, as a part without nodes, and all parts, robots first; None as `around`."""
    of_terms = list(graph.store.said_of(term for term in ontology.terms if isinstance(term, Name)))
    if any(map(_says_more, of_terms)):
        yield None
        return
    led_to = {node for row in of_terms for node in ontology.nodes(Triple(*row[:3]))}
    nodes = chain(led_to, graph.store.speakers(_NOT_FOLLOWED))  # as they are now, before anything is concluded
    known = [_hashes(ontology.terms)]  # of nodes 8 bytes each, for a fleet has millions
    alone = Region()
    alone.take((row for row in of_terms if row[3] != _ONTOLOGY and not ontology.nodes(Triple(*row[:3]))), ontology)
    yield alone
    for region in some(graph, ontology, graph.store.subjects(TYPE, _ROBOT) - ontology.terms):
        if region is not None:
            known.append(_hashes(region.nodes))
        yield region
    yield from some(graph, ontology, _unknown(nodes, np.concatenate(known)))


def _unknown(nodes: Iterator[Name], known: npt.NDArray[np.int64]) -> Iterator[Name]:
    """Yield the nodes whose hashes are not among those that are known, (N,)."""
    while batch := list(islice(nodes, _AT_ONCE)):
        yield from (node for node, is_known in zip(batch, np.isin(_hashes(batch), known), strict=True) if not is_known)


def together(regions: Iterable[Region | None]) -> Iterator[list[Region]]:
    """Yield parts, small ones some at a time, so that what is done for the ontology is done once for these.

    Raises Joined where they are not parts.
    """
    some, size = list[Region](), 0
    for region in regions:
        if region is None:
            raise Joined("a graph beside the ontology's says more of its terms")
        if not region.nodes:  # that of the ontology alone
            yield [region]
            continue
        some.append(region)
        size += len(region.asserted)
        if size > MOST_TOGETHER:
            yield some
            some, size = [], 0
    if some:
        yield some


def one(regions: Iterable[Region]) -> Region:
    """Return some parts as one."""
    whole = Region()
    for region in regions:
        whole.nodes |= region.nodes
        whole.asserted |= region.asserted
        whole.concluded |= region.concluded
    return whole


def _says_more(row: Row) -> bool:
    """Whether what is said of a term stands in an asserted graph that is not the ontology's."""
    return row[3] != _ONTOLOGY and _place(row[3].value) == _ASSERTED


def _hashes(nodes: Collection[object]) -> npt.NDArray[np.int64]:
    return np.fromiter(map(hash, nodes), np.int64, len(nodes))


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


def robots_about(ontology: Ontology, triples: Iterable[Triple], some: Iterable[Triple]) -> list[Name]:
    """Return the robots of those parts of a graph that some of its triples stand in."""
    statements = list(triples)
    part_of = parted(ontology, statements)
    about = {part_of(node) for triple in some for node in ontology.nodes(triple)}
    return [robot for robot in robots(ontology, statements) if part_of(robot) in about]


def robots(ontology: Ontology, part: Iterable[Triple]) -> list[Name]:
    """Return the robots of a part."""
    robots = {
        node
        for triple in part
        if (triple.predicate, triple.object) == (TYPE, _ROBOT)
        for node in ontology.nodes(triple)
    }
    return sorted(robots, key=str)


def spoken_for(ontology: Ontology, part: Iterable[Triple]) -> list[Name]:
    """Return who stands for a part: its robots; where it has none, its first node."""
    statements = list(part)
    return robots(ontology, statements) or [
        min((node for statement in statements for node in ontology.nodes(statement)), key=str)
    ]


@lru_cache(maxsize=1)
def _schema(ontology: frozenset[Triple]) -> Schema:
    return Schema(ontology)


def _place(name: str) -> str:
    """Return what a named graph holds, of `_ASSERTED` and the others."""
    if name.startswith(_NOT_PARTS):
        return _APART
    if name == GRAPH_REASONED:
        return _NOTED
    return _CONCLUDED if name.startswith(GRAPH_INFERRED) else _ASSERTED
