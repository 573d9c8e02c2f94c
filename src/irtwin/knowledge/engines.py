"""The engines that conclude from OWL: the one that ships, owlrl to check it by, and HermiT for OWL 2 DL."""

from __future__ import annotations

import io
from collections.abc import Collection
from pathlib import Path

from pyoxigraph import NamedNode, RdfFormat, Triple, serialize

from irtwin.knowledge.java import NoJava, java
from irtwin.knowledge.owl_rl.closure import Closure, says_something
from irtwin.knowledge.store.rdf_input import format_of, read_triples
from irtwin.knowledge.vocabulary import PREFIXES, REASONER
from irtwin.storage.files import check_place, write

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
    classified, closure = _closed(engine, triples)
    return classified.union(closure.inferred()).difference(triples)


def worth_keeping(engine: str, triples: Collection[Triple]) -> set[Triple]:
    """Return what follows and is worth keeping in a graph, as `Closure.worth_keeping` has it; like `inferred`."""
    if engine == OWLRL:
        from irtwin.knowledge.owl_rl import by_owlrl

        return by_owlrl.worth_keeping(triples)
    classified, closure = _closed(engine, triples)
    return closure.worth_keeping().union(filter(says_something, classified)).difference(triples)


def close_file(source: Path, out: Path, engine: str = NATIVE) -> int:
    """Write what a file says and all that an engine infers from it; return how many triples were inferred.

    The suffixes tell the formats. `owl:imports` are not followed. The file is there whole or not at all. Raises
    InputError on a file that cannot be read or is too much for the engine, Contradiction on one that contradicts
    itself.
    """
    form = format_of(out)
    check_place(out)
    given = dict.fromkeys(read_triples(source))
    check(engine, len(given))
    conclusions = sorted(inferred(engine, given), key=str)
    prefixes = PREFIXES if form in (RdfFormat.TURTLE, RdfFormat.TRIG, RdfFormat.RDF_XML) else None
    content = io.BytesIO()
    serialize([*given, *conclusions], content, form, prefixes=prefixes)
    write(out, content.getvalue())
    return len(conclusions)


def _closed(engine: str, triples: Collection[Triple]) -> tuple[set[Triple], Closure]:
    """Return what HermiT finds, if it is asked, and the closure, which adds what lies above its results."""
    classified = set[Triple]()
    if engine == HERMIT:
        from irtwin.knowledge import owl_dl  # owlready2 takes a while to import

        classified = owl_dl.classify(triples)
    return classified, Closure({*triples, *classified})
