"""Reasoning part by part: each is closed and ruled beside the ontology alone, and few are held at once.

Where a part turns out to bear on others (see `parts`) it cannot be done so, and all of the graph is to be reasoned
over; what was written until then is written anew.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import chain

from pyoxigraph import Literal, Quad, Triple

from irtwin.knowledge import parts
from irtwin.knowledge.conclusions import CONTRADICTION, Conclusions, by_rules, contain, graph_of, infer
from irtwin.knowledge.owl_rl.beside import Equality, FactsClosure
from irtwin.knowledge.owl_rl.closure import Contradiction, say
from irtwin.knowledge.parts import EQUALITIES, Joined, Name, Ontology, Region
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_OWL_RL, GRAPH_REASONED, TYPE

MOST_WAITING = 50_000  # quads that wait to be written


@dataclass
class Changes:
    """What changes in the graph: quads that wait to be written; how many are new, by named graph; notes on parts."""

    graph: KnowledgeGraph
    whole: bool
    removed: set[Quad] = field(default_factory=set)
    added: set[Quad] = field(default_factory=set)
    new: Counter[str] = field(default_factory=Counter)
    noted: set[Quad] = field(default_factory=set)

    def take(self, region: Region, concluded: set[Quad]) -> None:
        """Let a part's conclusions be in the place of what was concluded of it; write when there are many."""
        removed, added = region.concluded - concluded, concluded - region.concluded
        if has_blank_node(removed | added):
            raise Joined("a node without a name")
        self.new.update(map(graph_of, added - self.added))  # of a cell, each of its robots' parts concludes the same
        self.removed |= removed
        self.added |= added
        self.noted.update(quad for quad in region.concluded | added if graph_of(quad) == GRAPH_REASONED)
        if len(self.removed) + len(self.added) > MOST_WAITING:
            self.write(self.graph.made_of() if self.whole else ())

    def write(self, removed: Iterable[Quad] = (), added: Iterable[Quad] = ()) -> None:
        """Write what waits, and more; a name of what conclusions are made of goes before they change."""
        self.graph.change(self.removed.union(removed), self.added.union(added))
        self.removed, self.added = set(), set()


def conclude(graph: KnowledgeGraph, ontology: Ontology, seeds: Iterable[Name] | None = None) -> Changes:
    """Conclude of the parts that some nodes belong to, of all parts if none are given; return what is to be written.

    Raises Joined where parts bear on each other.
    """
    if ontology.schema.unfit is not None:
        raise Joined(ontology.schema.unfit)
    changes, minted = Changes(graph, seeds is None), set[Name]()
    regions = parts.every(graph, ontology) if seeds is None else parts.some(graph, ontology, seeds)
    for some in parts.together(regions):
        for region, conclusions in _conclude(ontology, some):
            concluded = conclusions.quads()
            own = _minted(ontology, region, concluded - region.concluded)
            if not minted.isdisjoint(own) or any(graph.store.about(node) for node in own):
                raise Joined("what rules conclude of several robots, and the ontology does not name")
            minted |= own
            changes.take(region, concluded)
    return changes


def _minted(ontology: Ontology, region: Region, added: Iterable[Quad]) -> set[Name]:
    """Return the nodes that are not of a part, which only its new conclusions speak of."""
    of_nodes = (quad.triple for quad in added if graph_of(quad) != GRAPH_REASONED)
    return {node for triple in of_nodes for node in ontology.nodes(triple)} - region.nodes


def _conclude(ontology: Ontology, regions: list[Region]) -> Iterator[tuple[Region, Conclusions]]:
    """Conclude of some parts as of one; of a part that FactsClosure does not take all but what follows from a clash."""
    region = regions[0] if len(regions) == 1 else parts.one(regions)
    if not region.nodes:
        yield region, Conclusions({GRAPH_OWL_RL: ontology.schema.kept})
        return
    if not region.asserted:
        yield region, Conclusions()
        return
    _refuse_crossing(ontology, region.asserted)
    try:
        concluded = _beside(ontology, frozenset(region.asserted))
    except (Contradiction, Equality):
        if len(regions) > 1:
            for alone in regions:
                yield from _conclude(ontology, [alone])
            return
        concluded = _alone(ontology, region.asserted)
    _refuse_crossing(ontology, concluded.concluded())
    yield region, concluded


def _refuse_crossing(ontology: Ontology, statements: Iterable[Triple]) -> None:
    """Raise Joined for a statement that concerns all parts."""
    properties, classes = ontology.models
    for statement in statements:
        is_of_models = statement.predicate in properties or (
            statement.predicate == TYPE and statement.object in classes
        )
        if is_of_models or statement.subject in ontology.terms:
            raise Joined(say(statement))


@lru_cache(maxsize=1)  # what was tried on a copy of the graph is done to the graph
def _beside(ontology: Ontology, asserted: frozenset[Triple]) -> Conclusions:
    """Conclude by what the ontology has told once. Raises Equality where names are equal or are said to differ."""
    if any(triple.predicate in EQUALITIES for triple in asserted):
        raise Equality
    closure = FactsClosure(ontology.schema, set(asserted))
    return by_rules(ontology, chain(ontology.triples, ontology.schema.kept, asserted), closure)


def _alone(ontology: Ontology, asserted: set[Triple]) -> Conclusions:
    """Conclude of a part without what clashes; nothing of a part whose clashes have no end."""
    robots = parts.spoken_for(ontology, asserted)
    try:
        aside, concluded = contain(ontology.triples, asserted, partial(infer, ontology, asserted))
    except Contradiction as endless:
        return Conclusions(made_by={Triple(robot, CONTRADICTION, Literal(str(endless))) for robot in robots})
    concluded.made_by = aside.notes(robots)
    concluded.contents[GRAPH_OWL_RL] = concluded.contents[GRAPH_OWL_RL] - ontology.schema.kept
    return concluded
