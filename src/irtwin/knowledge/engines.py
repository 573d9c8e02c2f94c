"""The engines that conclude from OWL: the one that ships, owlrl to check it by, and HermiT for OWL 2 DL."""

from __future__ import annotations

from collections.abc import Collection

from pyoxigraph import NamedNode, Triple

from irtwin.knowledge.java import NoJava, java
from irtwin.knowledge.owl_rl.closure import Closure, says_something
from irtwin.knowledge.vocabulary import REASONER

NATIVE, OWLRL, HERMIT = "native", "owlrl", "hermit"
ENGINES = (NATIVE, OWLRL, HERMIT)


def reasoner(engine: str) -> NamedNode:
    """Return the individual of the ontology that an engine is."""
    return NamedNode(REASONER + engine)


def check(engine: str, triples: int) -> None:
    """Raise InputError where an engine cannot run, or would take too long for so many triples."""
    if engine == HERMIT and java() is None:
        raise NoJava
    if engine == OWLRL:
        from irtwin.knowledge.owl_rl import by_owlrl

        by_owlrl.check_size(triples)


def inferred(engine: str, triples: Collection[Triple]) -> set[Triple]:
    """Return all that follows and was not given; Contradiction where the triples contradict each other."""
    if engine == OWLRL:
        from irtwin.knowledge.owl_rl import by_owlrl

        return by_owlrl.inferred(triples)
    found, closure = _closed(engine, triples)
    return found.union(closure.inferred()).difference(triples)


def worth_keeping(engine: str, triples: Collection[Triple]) -> set[Triple]:
    """Return what follows and is worth keeping in a graph, as `Closure.worth_keeping` has it; like `inferred`."""
    if engine == OWLRL:
        from irtwin.knowledge.owl_rl import by_owlrl

        return by_owlrl.worth_keeping(triples)
    found, closure = _closed(engine, triples)
    return closure.worth_keeping().union(filter(says_something, found)).difference(triples)


def _closed(engine: str, triples: Collection[Triple]) -> tuple[set[Triple], Closure]:
    """Return what HermiT finds, if it is asked, and the closure, which adds what lies above its results."""
    found = set[Triple]()
    if engine == HERMIT:
        from irtwin.knowledge import owl_dl  # owlready2 takes a while to import

        found = owl_dl.classify(triples)
    return found, Closure({*triples, *found})
