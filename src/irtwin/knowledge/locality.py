"""What keeps a rule within one robot: from where it starts, it must come only to what is joined to it.

A rule or constraint is followed from its focus node along its triple patterns. From subject to object it comes to what
the same part of the graph says, or to the ontology. From object to subject it may come from a term of the ontology to
any robot; and patterns that nothing joins to the focus node fit any robot's facts. The predicates of both are told
here, so that `parts` can see whether some robot's facts make use of them.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import lru_cache, reduce
from itertools import chain
from operator import or_
from typing import Any

import rdflib
from pyoxigraph import NamedNode, Triple
from rdflib.paths import AlternativePath, InvPath, MulPath, SequencePath
from rdflib.plugins.sparql import prepareQuery
from rdflib.plugins.sparql.algebra import traverse
from rdflib.plugins.sparql.parserutils import CompValue

from irtwin.knowledge.rules.files import all_rules
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.vocabulary import PREFIXES, SH
from irtwin.resources import Files, Resources

_TYPE = rdflib.RDF.type
_THIS = rdflib.Variable("this")
_TEXTS = {SH + name for name in ("select", "ask", "construct")}

ANY = "?"  # among predicates

Pattern = tuple[Any, Any, Any]  # of rdflib's terms and paths


@dataclass(frozen=True)
class Reach:
    """How far rules look: all in IRIs.

    `backward`: predicates that they follow from object to subject. `anywhere`: predicates of facts that they look for
    in all of the graph. `terms`: what they name. `unknown`: why they may look farther than this says; empty else.
    `predicates`: of all facts that they look at, among them ANY where that is not known.
    """

    backward: frozenset[str] = frozenset()
    anywhere: frozenset[str] = frozenset()
    terms: frozenset[str] = frozenset()
    unknown: frozenset[str] = frozenset()
    predicates: frozenset[str] = frozenset()

    def __or__(self, other: Reach) -> Reach:
        """Return how far both look."""
        return Reach(
            self.backward | other.backward,
            self.anywhere | other.anywhere,
            self.terms | other.terms,
            self.unknown | other.unknown,
            self.predicates | other.predicates,
        )


KNOWN: dict[str, Reach] = {}  # by the query's text


def of_all_rules(resources: Resources) -> Reach:
    """Return how far the rules and the constraints look."""
    return _of_rules(resources.of("rules")) | _of_shapes(resources.of("shapes"))


def read_by_rules(resources: Resources, *known: Iterable[Triple]) -> Iterator[Triple]:
    """Yield those of some triples that rules look at."""
    read = _of_rules(resources.of("rules")).predicates
    return (triple for triple in chain(*known) if ANY in read or triple.predicate.value in read)


@lru_cache(maxsize=16)
def _of_rules(files: Files) -> Reach:
    return reduce(or_, (of_query(rule.construct) for rule in all_rules(Resources(files))), Reach())


@lru_cache(maxsize=16)
def _of_shapes(files: Files) -> Reach:
    return reduce(or_, (of_shapes(read_turtle(file.path)) for file in files), Reach())


def of_query(text: str) -> Reach:
    """Return how far a query looks from `$this`."""
    if text not in KNOWN:
        KNOWN[text] = _of_query(text)
    return KNOWN[text]


def _of_query(text: str) -> Reach:
    patterns: list[Pattern] = []
    named: set[Any] = {_THIS}
    terms: set[str] = set()
    unknown: set[str] = set()

    def visit(node: Any) -> None:
        if not isinstance(node, CompValue):
            return
        for triples in node.get("triples") or () if node.name in ("BGP", "TriplesBlock") else ():
            patterns.extend(zip(*[iter(triples)] * 3, strict=True))  # rdflib strings those within EXISTS together
        if node.name == "Extend" and isinstance(node.expr, rdflib.URIRef):
            named.add(node.var)
            terms.add(str(node.expr))
        if node.name in ("Group", "SubSelect") and "this" not in str(node.get("expr") or node.get("projection")):
            unknown.add(f"{node.name} without $this")
        if node.name in ("Graph", "ServiceGraphPattern"):
            unknown.add(node.name)

    query = prepareQuery(text, initNs=PREFIXES)
    traverse(query.algebra.p, visitPre=visit)
    return _reach(patterns, named) | Reach(unknown=frozenset(unknown), terms=frozenset(terms))


def of_shapes(triples: Iterable[Triple]) -> Reach:
    """Return how far the constraints of a shapes graph look from their focus nodes."""
    reach = Reach()
    for triple in triples:
        if triple.predicate.value == SH + "inversePath":
            iri = triple.object.value if isinstance(triple.object, NamedNode) else ""
            reach |= Reach(backward=frozenset({iri})) if iri else Reach(unknown=frozenset({"sh:inversePath of a path"}))
        elif triple.predicate.value in _TEXTS:
            reach |= of_query(str(getattr(triple.object, "value", "")))
    return reach


def _reach(patterns: Collection[Pattern], start: set[Any]) -> Reach:
    """Follow patterns from `start`, and from terms that they name, as far as subjects lead to objects."""
    reached, left = set(start), list(patterns)
    backward, anywhere, unknown = set[str](), set[str](), set[str]()
    while left:
        pattern = next((it for it in left if _known(it[0], reached)), None)
        if pattern is None:
            pattern = next((it for it in left if it[2] in reached and _simple(it[1])), left[0])
            told = backward if pattern[2] in reached else anywhere
            if _simple(pattern[1]):
                told.add(str(pattern[1]))
            else:
                unknown.add(f"{pattern[1]} where its subject is not known")
        elif not _leads_forward(pattern[1]):
            unknown.add(f"{pattern[1]} in a rule")
        left.remove(pattern)
        reached |= {pattern[0], pattern[2]}
    read = frozenset(name for _, predicate, _ in patterns for name in _predicates(predicate))
    return Reach(frozenset(backward), frozenset(anywhere), frozenset(_iris(patterns)), frozenset(unknown), read)


def _known(term: Any, reached: set[Any]) -> bool:
    return term in reached or isinstance(term, rdflib.URIRef)


def _simple(predicate: Any) -> bool:
    return isinstance(predicate, rdflib.URIRef) and predicate != _TYPE


def _predicates(path: Any) -> Iterator[str]:
    if isinstance(path, SequencePath | AlternativePath):
        for one in path.args:
            yield from _predicates(one)
    elif isinstance(path, MulPath):
        yield from _predicates(path.path)
    elif isinstance(path, InvPath):
        yield from _predicates(path.arg)
    else:
        yield str(path) if isinstance(path, rdflib.URIRef) else ANY


def _leads_forward(path: Any) -> bool:
    if isinstance(path, SequencePath | AlternativePath):
        return all(map(_leads_forward, path.args))
    if isinstance(path, MulPath):
        return _leads_forward(path.path)
    return isinstance(path, rdflib.URIRef | rdflib.Variable)


def _iris(patterns: Iterable[Pattern]) -> Iterator[str]:
    """Yield the IRIs of individuals and classes that patterns name."""
    for subject, _, object in patterns:
        yield from (str(term) for term in (subject, object) if isinstance(term, rdflib.URIRef))
