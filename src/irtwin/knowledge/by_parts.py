"""Reasoning part by part: each is closed and ruled beside the ontology alone, and few are held at once.

Where a part turns out to bear on others (see `parts`) it cannot be done so, and all of the graph is to be reasoned
over; what was written until then is written anew.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from contextlib import closing
from dataclasses import dataclass, field
from functools import partial
from itertools import chain
from typing import Any

from pyoxigraph import Literal, Quad, RdfFormat, Triple, parse, serialize

from irtwin.knowledge import each_part, parts
from irtwin.knowledge.conclusions import Conclusions, by_rules, graph_of, infer
from irtwin.knowledge.contained import CONTRADICTION, contain
from irtwin.knowledge.owl_rl.beside import Beside, Equality
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.knowledge.parts import Borders, Joined, Name, Ontology, Region
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_OWL_RL, GRAPH_REASONED

MOST_WAITING = 50_000  # quads that wait to be written; while they are, workers go on


@dataclass(frozen=True)
class Change:
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
    """What changes in the graph: quads that wait to be written; the named graphs that differ; all notes on parts."""

    graph: KnowledgeGraph
    whole: bool
    removed: set[Quad] = field(default_factory=set)
    added: set[Quad] = field(default_factory=set)
    names: set[str] = field(default_factory=set)
    noted: set[Quad] = field(default_factory=set)

    def take(self, change: Change) -> None:
        """Let some quads be in the place of others, and know of notes that stood before; write when there are many."""
        if has_blank_node(change.removed | change.added):
            raise Joined
        self.removed |= change.removed
        self.added |= change.added
        self.names.update(map(graph_of, change.removed | change.added))
        self.noted.update(change.noted, (quad for quad in change.added if graph_of(quad) == GRAPH_REASONED))
        if len(self.removed) + len(self.added) > MOST_WAITING:
            self.write(self.graph.made_of() if self.whole else ())

    def write(self, removed: Iterable[Quad] = (), added: Iterable[Quad] = ()) -> None:
        """Write what waits, and more; a name of what conclusions are made of goes before they change."""
        self.graph.change(self.removed.union(removed), self.added.union(added))
        self.removed, self.added = set(), set()

    @property
    def grown(self) -> Counter[str]:
        """By how many quads the named graphs will grow when what waits is written."""
        grown = Counter(map(graph_of, self.added - self.removed))
        grown.subtract(map(graph_of, self.removed - self.added))
        return grown


def conclude(graph: KnowledgeGraph, ontology: Ontology, seeds: Iterable[Name] | None = None) -> Changes:
    """Conclude of the parts that some nodes belong to, of all parts if none are given; return what is to be written.

    Raises Joined where parts bear on each other.
    """
    if ontology.schema.unfit is not None:
        raise Joined
    changes, minted = Changes(graph, seeds is None), set[Name]()
    if seeds is None:
        found = each_part.of_each(graph, ontology, changes_of)
    else:
        found = each_part.of_these(ontology, parts.some(graph, ontology, seeds), changes_of)
    with closing(found):
        for change in found:
            if not minted.isdisjoint(change.minted) or any(graph.about(node) for node in change.minted):
                raise Joined
            minted |= change.minted
            changes.take(change)
    return changes


def _read(removed: bytes, added: bytes, noted: bytes, minted: set[Name]) -> Change:
    gone, come, before = (set(parse(some, format=RdfFormat.N_QUADS)) for some in (removed, added, noted))
    return Change(gone, come, before, minted)


def changes_of(ontology: Ontology, regions: list[Region]) -> Iterator[Change]:
    """Yield what changes with the conclusions of some parts. Raises Joined where they bear on others."""
    for region, found in _conclude(ontology, regions):
        removed, added = region.concluded, found.quads()
        removed, added = removed - added, added - removed  # what was concluded before speaks of the region's nodes
        nodes = {node for quad in added if graph_of(quad) != GRAPH_REASONED for node in ontology.nodes(quad.triple)}
        noted = {quad for quad in region.concluded if graph_of(quad) == GRAPH_REASONED}
        yield Change(removed, added, noted, nodes - region.nodes)


def _conclude(ontology: Ontology, regions: list[Region]) -> Iterator[tuple[Region, Conclusions]]:
    """Conclude of some parts as of one; of a part that contradicts itself all but what follows from the clash."""
    region = regions[0] if len(regions) == 1 else parts.one(regions)
    try:
        yield region, _conclude_of_one(ontology, region)
    except Contradiction as clash:
        if len(regions) == 1:
            yield region, _contained(ontology, region, clash)
            return
        for alone in regions:
            yield from _conclude(ontology, [alone])


def _conclude_of_one(ontology: Ontology, region: Region, aside: AbstractSet[Triple] = frozenset()) -> Conclusions:
    if not region.nodes:
        return Conclusions({GRAPH_OWL_RL: ontology.schema.kept})
    if not region.asserted:
        return Conclusions()
    borders = ontology.borders  # numbers terms, so it comes before facts take numbers of their own
    try:
        asserted = region.asserted - aside
        closure = Beside(ontology.schema, asserted)
        _check(borders, closure)
        found = by_rules(ontology, chain(ontology.triples, ontology.schema.kept, asserted), closure, aside)
        _check(borders, closure)
    except Equality as same:
        raise Joined from same
    return found


def _check(borders: Borders, closure: Beside) -> None:
    if borders.crossed_by(closure):
        raise Joined


def _contained(ontology: Ontology, region: Region, clash: Contradiction) -> Conclusions:
    """Conclude of a part without what clashes; nothing of a part whose clashes have no end."""
    robots = parts.spoken_for(ontology, region.asserted)
    try:
        aside, _ = contain(clash, ontology.triples, region.asserted, partial(infer, ontology, region.asserted))
        found = _conclude_of_one(ontology, region, aside.statements | aside.conclusions)
    except Contradiction as endless:
        return Conclusions(made_by={Triple(robot, CONTRADICTION, Literal(str(endless))) for robot in robots})
    found.made_by = aside.notes(robots)
    return found
