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
        raise NoJava("HermiT")
    if engine == OWLRL:
        from irtwin.knowledge.owl_rl import by_owlrl

        by_owlrl.check_size(triples)


def inferred(engine: str, triples: Collection[Triple]) -> set[Triple]:
    """Return all that follows and was not given; Contradiction where the triples contradict each other."""
    if engine == OWLRL:
        from irtwin.knowledge.owl_rl import by_owlrl

        return by_owlrl.inferred(triples)
    found = _by_hermit(triples) if engine == HERMIT else set()
    return (found | set(Closure({*triples, *found}).inferred())).difference(triples)


def worth_keeping(engine: str, triples: Collection[Triple]) -> set[Triple]:
    """Return what follows and is worth keeping in a graph, as `Closure.worth_keeping` has it; like `inferred`."""
    if engine == OWLRL:
        from irtwin.knowledge.owl_rl import by_owlrl

        return by_owlrl.worth_keeping(triples)
    found = _by_hermit(triples) if engine == HERMIT else set()
    closed = Closure({*triples, *found}).worth_keeping()
    return (set(filter(says_something, found)) | closed).difference(triples)


def _by_hermit(triples: Collection[Triple]) -> set[Triple]:
    """Return what HermiT finds. It leaves out what lies above its results: OWL 2 RL is to add that."""
    from irtwin.knowledge import owl_dl  # owlready2 takes a while to import

    return owl_dl.classify(triples)
