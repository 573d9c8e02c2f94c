"""The OWL 2 RL closure: the W3C's rules, run as SPARQL until nothing is new."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from functools import cache
from typing import cast

from pyoxigraph import BlankNode, NamedNode, QuerySolutions, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.graph import in_graph
from irtwin.knowledge.vocabulary import OWL, PREFIXES, shorten
from irtwin.resources import folder

_RULE = re.compile(r"^## (\S+)\n(.+)$", re.MULTILINE)
_HELPER = "urn:irtwin:owl2-rl:"
_THING = NamedNode(OWL + "Thing")
_PREFIXES = {**PREFIXES, "rl": _HELPER}
_LIST_ITEMS = """
    INSERT { ?list rl:item ?item }
    WHERE { ?list rdf:rest* ?rest . ?rest rdf:first ?item }"""


@dataclass(frozen=True)
class Rule:
    """A rule by the W3C's name: a CONSTRUCT that concludes, or a SELECT that finds a contradiction."""

    name: str
    text: str

    @property
    def concludes(self) -> bool:
        """Whether the rule draws a conclusion."""
        return self.text.startswith("CONSTRUCT")


@cache
def rules() -> tuple[Rule, ...]:
    """Return the rules of `rules/owl2_rl.rq`."""
    text = (folder("rules") / "owl2_rl.rq").read_text(encoding="utf-8")
    return tuple(Rule(*match) for match in _RULE.findall(text))


def closure(triples: Iterable[Triple]) -> set[Triple]:
    """Return what OWL 2 RL infers from the triples and they do not say themselves.

    What is inferred of anonymous class expressions is left out. InputError names the first contradiction.
    """
    store = Store()
    store.extend(in_graph(triples))
    given = _content(store)
    store.update(_LIST_ITEMS, prefixes=_PREFIXES)
    before = 0
    while len(store) > before:
        before = len(store)
        for rule in rules():
            if rule.concludes:
                store.update("INSERT" + rule.text.removeprefix("CONSTRUCT"), prefixes=_PREFIXES)
    _refuse_contradiction(store)
    return {triple for triple in _content(store) - given if _worth_keeping(triple)}


def _content(store: Store) -> set[Triple]:
    return {quad.triple for quad in store}


def _refuse_contradiction(store: Store) -> None:
    for rule in rules():
        if rule.concludes:
            continue
        for found in cast(QuerySolutions, store.query(rule.text + " LIMIT 1", prefixes=_PREFIXES)):
            culprits = ", ".join(_name(term) for term in found)
            raise InputError(f"the graph contradicts the ontology (OWL 2 RL rule {rule.name}): {culprits}")


def _name(term: object) -> str:
    return shorten(term.value) if isinstance(term, NamedNode) else str(term)


def _worth_keeping(triple: Triple) -> bool:
    anonymous = isinstance(triple.subject, BlankNode) or isinstance(triple.object, BlankNode)
    return not (anonymous or triple.predicate.value.startswith(_HELPER) or triple.object == _THING)
