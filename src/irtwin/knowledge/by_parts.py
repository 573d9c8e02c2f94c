"""Reasoning part by part: each is closed and ruled beside the ontology alone, and few are held at once.

Some parts are taken together, as Pellet is slow to start. Where a part turns out to bear on others (see `parts`) it
cannot be done so, and all of the graph is to be reasoned over; what was written until then is written anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from pyoxigraph import Literal, NamedNode, Quad, Triple

from irtwin.knowledge import parts
from irtwin.knowledge.conclusions import Conclusions, by_shacl, by_swrl, facts_of_swrl, graph_of, names_of
from irtwin.knowledge.owl_rl.beside import Beside, Equality
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.parts import Ontology, Region
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_OWL_RL, GRAPH_REASONED, GRAPH_SWRL, term

MOST_TOGETHER = 250_000  # triples of parts that are concluded of together; they take some 500 MB
MOST_WAITING = 200_000  # quads that wait to be written
_CONTRADICTION = NamedNode(term("Contradiction"))


class Joined(Exception):
    """A part bears on others."""


@dataclass
class Changes:
    """What changes in the graph: quads that wait to be written; the named graphs that differ; all notes on parts."""

    graph: KnowledgeGraph
    whole: bool
    removed: set[Quad] = field(default_factory=set)
    added: set[Quad] = field(default_factory=set)
    names: set[str] = field(default_factory=set)
    noted: set[Quad] = field(default_factory=set)

    def take(self, old: set[Quad], new: set[Quad]) -> None:
        """Let some quads be in the place of others; write when there are many."""
        if has_blank_node(new ^ old):
            raise Joined
        self.removed |= old - new
        self.added |= new - old
        self.names.update(graph_of(quad) for quad in new ^ old)
        self.noted.update(quad for quad in old | new if graph_of(quad) == GRAPH_REASONED)
        if len(self.removed) + len(self.added) > MOST_WAITING:
            self.write(self.graph.made_of() if self.whole else ())

    def write(self, removed: Iterable[Quad] = (), added: Iterable[Quad] = ()) -> None:
        """Write what waits, and more; a name of what conclusions are made of goes before they change."""
        self.graph.change(self.removed.union(removed), self.added.union(added))
        self.removed, self.added = set(), set()


def conclude(graph: KnowledgeGraph, ontology: Ontology, regions: Iterable[Region | None], whole: bool) -> Changes:
    """Conclude of some parts, or of the `whole` graph part by part; return what is yet to be written.

    Raises Joined where parts bear on each other.
    """
    if ontology.schema.unfit is not None:
        raise Joined
    changes, minted = Changes(graph, whole), set[parts.Name]()
    for some in _together(regions):
        for region, found in _conclude(ontology, some):
            new = found.quads()
            nodes = {node for quad in new if graph_of(quad) != GRAPH_REASONED for node in ontology.nodes(quad.triple)}
            nodes -= region.nodes
            if not minted.isdisjoint(nodes) or any(graph.about(node) for node in nodes):
                raise Joined
            minted |= nodes
            changes.take(region.concluded, new)
    return changes


def _together(regions: Iterable[Region | None]) -> Iterator[list[Region]]:
    some, size = list[Region](), 0
    for region in regions:
        if region is None:
            raise Joined
        some.append(region)
        size += len(region.asserted)
        if size > MOST_TOGETHER:
            yield some
            some, size = [], 0
    yield some


def _conclude(ontology: Ontology, regions: list[Region]) -> Iterator[tuple[Region, Conclusions]]:
    """Conclude of some parts, each by itself; of one that contradicts itself nothing but that."""
    closures: list[tuple[Region, Beside, set[Triple]]] = []
    for region in regions:
        if not region.nodes:
            yield region, Conclusions({GRAPH_OWL_RL: ontology.schema.kept})
        elif not region.asserted:
            yield region, Conclusions()
        else:
            try:
                closure = _closed(ontology, region)
                closures.append((region, closure, closure.worth_keeping()))
            except Contradiction as clash:
                yield region, _set_aside(ontology, region, clash)
    yield from _rule(ontology, closures)


def _closed(ontology: Ontology, region: Region) -> Beside:
    try:
        closure = Beside(ontology.schema, region.asserted)
    except Equality as same:
        raise Joined from same
    _check(ontology, closure)
    return closure


def _check(ontology: Ontology, closure: Beside) -> None:
    if ontology.borders.crossed(closure):
        raise Joined


def _rule(
    ontology: Ontology, closures: list[tuple[Region, Beside, set[Triple]]]
) -> Iterator[tuple[Region, Conclusions]]:
    of_all = ontology.triples | ontology.schema.kept
    facts: dict[parts.Name, set[Triple]] = {}
    own: list[dict[parts.Name, set[Triple]]] = []
    for region, _, kept in closures:
        own.append(facts_of_swrl(ontology, of_all | region.asserted | kept, joined=False))
        facts |= own[-1]
    try:
        swrl = by_swrl(ontology, facts, set().union(*(region.concluded for region, _, _ in closures)))
    except Contradiction as clash:
        if len(closures) == 1:
            yield closures[0][0], _set_aside(ontology, closures[0][0], clash)
            return
        for one in closures:
            yield from _rule(ontology, [one])
        return
    for (region, closure, kept), some in zip(closures, own, strict=True):
        of_part = {triple for triple in swrl if not region.nodes.isdisjoint(ontology.nodes(triple))}
        contents = {GRAPH_SWRL: of_part, **by_shacl(ontology, of_all | region.asserted | kept | of_part)}
        found = Conclusions(contents, names_of(some, ontology.resources))
        try:
            closure.add(found.concluded())
            _check(ontology, closure)
            found.contents[GRAPH_OWL_RL] = closure.worth_keeping()
        except Equality as same:
            raise Joined from same
        except Contradiction as clash:
            found = _set_aside(ontology, region, clash)
        yield region, found


def _set_aside(ontology: Ontology, region: Region, clash: Contradiction) -> Conclusions:
    robots = parts.spoken_for(ontology, region.asserted)
    return Conclusions(made_by={Triple(robot, _CONTRADICTION, Literal(str(clash))) for robot in robots})
