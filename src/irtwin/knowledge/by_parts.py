"""Reasoning part by part: each is closed and ruled beside the ontology alone, and few are held at once.

Where a part turns out to bear on others (see `parts`) it cannot be done so, and all of the graph is to be reasoned
over; what was written until then is written anew.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from contextlib import closing
from dataclasses import dataclass, field
from functools import lru_cache, partial
from itertools import chain
from typing import Any

from pyoxigraph import Literal, Quad, RdfFormat, Triple, parse, serialize

from irtwin.knowledge import each_part, parts
from irtwin.knowledge.conclusions import Conclusions, by_rules, graph_of, infer
from irtwin.knowledge.contained import CONTRADICTION, contain
from irtwin.knowledge.owl_rl.beside import Beside, Equality
from irtwin.knowledge.owl_rl.closure import Contradiction, show
from irtwin.knowledge.parts import EQUALITIES, TYPE, Joined, Name, Ontology, Region
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_OWL_RL, GRAPH_REASONED

MOST_WAITING = 50_000  # quads that wait to be written; while they are, workers go on


@dataclass(frozen=True)
class PartChange:
    """What changes with the conclusions of some parts: quads that go and come, and notes that stood before.

    `minted` are nodes that are not of the parts, which only their conclusions speak of.
    """

    removed: set[Quad]
    added: set[Quad]
    noted: set[Quad]
    minted: set[Name]

    def __reduce__(self) -> tuple[Any, ...]:
        """Go to another process as N-Quads: to pickle each term takes ten times as long."""
        quads = (serialize(some, format=RdfFormat.N_QUADS) for some in (self.removed, self.added, self.noted))
        return _read, (*quads, self.minted)


@dataclass
class Changes:
    """What changes in the graph: quads that wait to be written; how many are new, by named graph; notes on parts."""

    graph: KnowledgeGraph
    whole: bool
    removed: set[Quad] = field(default_factory=set)
    added: set[Quad] = field(default_factory=set)
    new: Counter[str] = field(default_factory=Counter)
    noted: set[Quad] = field(default_factory=set)

    def take(self, change: PartChange) -> None:
        """Let some quads be in the place of others, and know of notes that stood before; write when there are many."""
        if has_blank_node(change.removed | change.added):
            raise Joined("a node without a name")
        self.removed |= change.removed
        self.added |= change.added
        self.new.update(map(graph_of, change.added))
        self.noted.update(change.noted, (quad for quad in change.added if graph_of(quad) == GRAPH_REASONED))
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
    if seeds is None:
        found = each_part.of_each(graph, ontology, changes_of)
    else:
        found = each_part.of_these(ontology, parts.some(graph, ontology, seeds), changes_of)
    with closing(found):
        for change in found:
            if not minted.isdisjoint(change.minted) or any(graph.about(node) for node in change.minted):
                raise Joined("what rules conclude of several robots, and the ontology does not name")
            minted |= change.minted
            changes.take(change)
    return changes


def _read(removed: bytes, added: bytes, noted: bytes, minted: set[Name]) -> PartChange:
    gone, come, before = (set(parse(some, format=RdfFormat.N_QUADS)) for some in (removed, added, noted))
    return PartChange(gone, come, before, minted)


def changes_of(ontology: Ontology, regions: list[Region]) -> Iterator[PartChange]:
    """Yield what changes with the conclusions of some parts. Raises Joined where they bear on others."""
    for region, concluded in _conclude(ontology, regions):
        removed, added = region.concluded, concluded.quads()
        removed, added = removed - added, added - removed  # what was concluded before speaks of the region's nodes
        nodes = {node for quad in added if graph_of(quad) != GRAPH_REASONED for node in ontology.nodes(quad.triple)}
        noted = {quad for quad in region.concluded if graph_of(quad) == GRAPH_REASONED}
        yield PartChange(removed, added, noted, nodes - region.nodes)


def _conclude(ontology: Ontology, regions: list[Region]) -> Iterator[tuple[Region, Conclusions]]:
    """Conclude of some parts as of one; of a part that Beside does not take all but what follows from a clash."""
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
    for it in statements:
        is_of_models = it.predicate in properties or (it.predicate == TYPE and it.object in classes)
        if is_of_models or it.subject in ontology.terms:
            raise Joined(f"{show(it.subject)} {show(it.predicate)} {show(it.object)}")


@lru_cache(maxsize=1)  # what was tried on a copy of the graph is done to the graph
def _beside(ontology: Ontology, asserted: frozenset[Triple]) -> Conclusions:
    """Conclude by what the ontology has told once. Raises Equality where names are equal or are said to differ."""
    if any(it.predicate in EQUALITIES for it in asserted):
        raise Equality
    closure = Beside(ontology.schema, set(asserted))
    return by_rules(ontology, chain(ontology.triples, ontology.schema.kept, asserted), closure)


def _alone(ontology: Ontology, asserted: set[Triple]) -> Conclusions:
    """Conclude of a part without what clashes; nothing of a part whose clashes have no end."""
    conclude = partial(infer, ontology, asserted)
    robots = parts.spoken_for(ontology, asserted)
    try:
        try:
            concluded = conclude()
        except Contradiction as clash:
            aside, concluded = contain(clash, ontology.triples, asserted, conclude)
            concluded.made_by = aside.notes(robots)
    except Contradiction as endless:
        return Conclusions(made_by={Triple(robot, CONTRADICTION, Literal(str(endless))) for robot in robots})
    concluded.contents[GRAPH_OWL_RL] = concluded.contents[GRAPH_OWL_RL] - ontology.schema.kept
    return concluded
