"""What a rule drew a conclusion from: its body asked again, for that conclusion alone."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any, cast

import rdflib
from pyoxigraph import BlankNode, Literal, NamedNode, QuerySolutions, Triple
from rdflib.plugins.sparql.parserutils import CompValue

from irtwin.knowledge.rdflib_terms import from_rdflib
from irtwin.knowledge.rules.conjunction import algebra
from irtwin.knowledge.rules.rule import Rule, group_of
from irtwin.knowledge.store.graph import KnowledgeGraph

_Term = NamedNode | BlankNode | Literal | Triple
_Bound = dict[str, _Term]


def premises(graph: KnowledgeGraph, rule: Rule, conclusion: Triple) -> tuple[Triple, ...] | None:
    """Return the facts that a rule drew a conclusion from, for the first way that is found; None where it did not.

    What must be absent for the rule to hold is not among them, nor what lies between the ends of a property path.
    """
    query = algebra(rule.construct)
    for pattern in query.template:
        bound = _unified(pattern, conclusion)
        if bound is not None:
            for known in _matches(graph, rule, bound):
                instances = dict.fromkeys(_instances(query.p, known))
                return tuple(triple for triple in instances if triple != conclusion and graph.holds(triple))
    return None


def _matches(graph: KnowledgeGraph, rule: Rule, bound: _Bound) -> Iterator[_Bound]:
    """Yield the values of the rule's variables for which it concludes what binds some of them."""
    prologue, body = group_of(rule)
    made = {name for name in bound if re.search(rf"\bAS\s+[?$]{name}\b", body, re.IGNORECASE)}
    before = " ".join(f"VALUES ?{name} {{ {value} }}" for name, value in bound.items() if name not in made)
    after = " ".join(f"FILTER(sameTerm(?{name}, {bound[name]}))" for name in made)
    answers = cast(QuerySolutions, graph.answer(f"{prologue} SELECT * WHERE {{ {before} {body} {after} }} LIMIT 1"))
    names = [variable.value for variable in answers.variables]
    for row in answers:
        yield {name: value for name, value in zip(names, row, strict=True) if value is not None} | bound


def _instances(algebra: Any, known: _Bound) -> Iterator[Triple]:
    """Yield the triple patterns of a query, but those of its filters, whose terms are all known."""
    if not isinstance(algebra, CompValue):
        return
    for pattern in algebra.get("triples") or ():
        terms = [_value(term, known) for term in pattern]
        if None not in terms:
            yield Triple(*terms)  # type: ignore[arg-type]
    for name, part in algebra.items():
        if name != "expr":
            for inner in part if isinstance(part, list) else [part]:
                yield from _instances(inner, known)


def _unified(pattern: tuple[Any, Any, Any], triple: Triple) -> _Bound | None:
    bound: _Bound = {}
    for term, value in zip(pattern, triple, strict=True):
        if isinstance(term, rdflib.Variable):
            if bound.setdefault(str(term), value) != value:
                return None
        elif _value(term, {}) != value:
            return None
    return bound


def _value(term: Any, known: _Bound) -> _Term | None:
    """Return the value of a term; None of a variable that has none, and of a property path."""
    return known.get(str(term)) if isinstance(term, rdflib.Variable | rdflib.BNode) else from_rdflib(term)
