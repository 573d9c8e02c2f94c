"""The OWL 2 RL closure: the W3C's cases, and how long some 20,000 triples of several robots take beside peers.

python bench/closure.py CASES         (the folder of cases; owlrl and reasonable take part where they are installed)

A case is judged as owlrl's authors judge it: the premise is closed, and holds the conclusion up to the names of blank
nodes; a premise without a conclusion is inconsistent. Times are of the processor, the least of three.
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from pathlib import Path

from pyoxigraph import BlankNode, Literal, NamedNode, Quad, RdfFormat, Store, Triple, parse, serialize

from irtwin.knowledge.owl_rl.closure import Closure, Contradiction
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID

TWO_ROBOTS = Path(__file__).parents[1] / "tests/knowledge/data/two_robots.trig"
SIZE = 20_000


def score(cases: Path) -> None:
    """Print how many cases hold, and the names of the rest."""
    entailments, inconsistencies, failed = [], [], []
    for case in sorted(cases.iterdir()):
        conclusions = list(case.glob("*conclusiongraph*"))
        premise = next(file for file in case.iterdir() if file not in conclusions)
        try:
            closed = _closed([quad.triple for quad in parse(path=str(premise), format=RdfFormat.TURTLE)])
            holds = bool(conclusions) and _entails(closed, conclusions[0])
            reason = "the conclusion is not in the closure"
        except Contradiction as clash:
            holds, reason = not conclusions, str(clash)
        (entailments if conclusions else inconsistencies).append(holds)
        failed += [] if holds else [f"  {case.name}: {reason}"]
    print(f"entailments {sum(entailments)} of {len(entailments)}", end=", ")
    print(f"inconsistencies {sum(inconsistencies)} of {len(inconsistencies)}", *failed, sep="\n")


def _closed(given: list[Triple]) -> Store:
    store = Store()
    store.extend(Quad(*triple) for triple in (*given, *Closure(given).inferred()))
    return store


def _entails(closed: Store, conclusion: Path) -> bool:
    wanted = (_pattern(quad.triple) for quad in parse(path=str(conclusion), format=RdfFormat.TURTLE))
    return bool(closed.query(f"ASK {{ {' '.join(wanted)} }}"))


def _pattern(triple: Triple) -> str:
    return " ".join(f"?b{term.value}" if isinstance(term, BlankNode) else str(term) for term in triple) + " ."


def robots(size: int) -> list[Triple]:
    """Return the ontology and as many copies of two robots as make `size` triples."""
    graph = KnowledgeGraph()
    graph.load_ontology()
    found = graph.triples()
    one = [quad.triple for quad in parse(path=str(TWO_ROBOTS), format=RdfFormat.TRIG)]
    for number in range(size):
        found |= {Triple(*(_renamed(term, number) for term in triple)) for triple in one}
        if len(found) >= size:
            break
    return sorted(found, key=str)


def _renamed(term: NamedNode | BlankNode | Literal, number: int) -> NamedNode | BlankNode | Literal:
    own = isinstance(term, NamedNode) and term.value.startswith(ID)
    return NamedNode(f"{term.value}/copy/{number}") if own else term


def peers(triples: list[Triple]) -> Iterator[tuple[str, Callable[[], int]]]:
    """Yield the reasoners that are at hand; each closes the triples and says how many it then holds."""
    yield "irtwin", lambda: len(triples) + sum(1 for _ in Closure(triples).inferred())
    yield "irtwin, what is worth keeping", lambda: len(triples) + len(Closure(triples).worth_keeping())
    file = Path(tempfile.mkdtemp()) / "robots.ttl"
    serialize(triples, str(file), RdfFormat.TURTLE)
    try:
        import reasonable

        yield "reasonable", lambda: len(_reasonable(reasonable, file))
    except ImportError:
        print("reasonable is not installed")
    try:
        import owlrl
        import rdflib

        yield "owlrl", lambda: len(_owlrl(owlrl, rdflib, file))
    except ImportError:
        print("owlrl is not installed")


def _reasonable(reasonable, file: Path):
    reasoner = reasonable.PyReasoner()
    reasoner.load_file(str(file))
    return reasoner.reason()


def _owlrl(owlrl, rdflib, file: Path):
    graph = rdflib.Graph().parse(file)
    owlrl.DeductiveClosure(owlrl.OWLRL_Semantics).expand(graph)
    return graph


def main(cases: Path) -> None:
    score(cases)
    triples = robots(SIZE)
    print(f"{len(triples)} triples")
    for name, close in peers(triples):
        times = []
        for _ in range(1 if name == "owlrl" else 3):
            began = time.process_time()
            held = close()
            times.append(time.process_time() - began)
        print(f"{name}: {min(times):.2f} s, {held} triples")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
