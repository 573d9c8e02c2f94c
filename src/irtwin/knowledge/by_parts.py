"""Reasoning part by part: each is closed and ruled beside the ontology alone, and few are held at once.

Where a part turns out to bear on others (see `parts`) it cannot be done so, and all of the graph is to be reasoned
over; what was written until then is written anew.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

from pyoxigraph import Literal, NamedNode, Quad, Triple

from irtwin.knowledge import parts
from irtwin.knowledge.conclusions import Conclusions, by_rules, graph_of
from irtwin.knowledge.owl_rl.beside import Beside, Equality
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.parts import Borders, Ontology, Region
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_OWL_RL, GRAPH_REASONED, term

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

    def take(self, removed: set[Quad], added: set[Quad], noted: Iterable[Quad]) -> None:
        """Let some quads be in the place of others, and know of notes that stood before; write when there are many."""
        if has_blank_node(removed | added):
            raise Joined
        self.removed |= removed
        self.added |= added
        self.names.update(map(graph_of, removed | added))
        self.noted.update(noted, (quad for quad in added if graph_of(quad) == GRAPH_REASONED))
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
    for some in parts.together(regions):
        if some is None:
            raise Joined
        for region, found in _conclude(ontology, some):
            removed, added = region.concluded, found.quads()
            removed, added = removed - added, added - removed  # what was concluded before speaks of the region's nodes
            nodes = {node for quad in added if graph_of(quad) != GRAPH_REASONED for node in ontology.nodes(quad.triple)}
            nodes -= region.nodes
            if not minted.isdisjoint(nodes) or any(graph.about(node) for node in nodes):
                raise Joined
            minted |= nodes
            changes.take(removed, added, (quad for quad in region.concluded if graph_of(quad) == GRAPH_REASONED))
    return changes


def _conclude(ontology: Ontology, regions: list[Region]) -> Iterator[tuple[Region, Conclusions]]:
    """Conclude of some parts as of one; of a part that contradicts itself nothing but that."""
    region = regions[0] if len(regions) == 1 else parts.one(regions)
    try:
        yield region, _conclude_of_one(ontology, region)
    except Contradiction as clash:
        if len(regions) == 1:
            yield region, _set_aside(ontology, region, clash)
            return
        for alone in regions:
            yield from _conclude(ontology, [alone])


def _conclude_of_one(ontology: Ontology, region: Region) -> Conclusions:
    if not region.nodes:
        return Conclusions({GRAPH_OWL_RL: ontology.schema.kept})
    if not region.asserted:
        return Conclusions()
    borders = ontology.borders  # numbers terms, so it comes before facts take numbers of their own
    try:
        closure = Beside(ontology.schema, region.asserted)
        _check(borders, closure)
        found = by_rules(ontology, ontology.triples, ontology.schema.kept, region.asserted, closure.worth_keeping())
        closure.add(found.concluded())
        _check(borders, closure)
    except Equality as same:
        raise Joined from same
    found.contents[GRAPH_OWL_RL] = closure.worth_keeping()
    return found


def _check(borders: Borders, closure: Beside) -> None:
    if borders.crossed_by(closure):
        raise Joined


def _set_aside(ontology: Ontology, region: Region, clash: Contradiction) -> Conclusions:
    robots = parts.spoken_for(ontology, region.asserted)
    return Conclusions(made_by={Triple(robot, _CONTRADICTION, Literal(str(clash))) for robot in robots})
