"""What a rule drew a conclusion from: its body asked again, for that conclusion alone."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from typing import Any, cast

import rdflib
from pyoxigraph import BlankNode, Literal, NamedNode, QuerySolutions, Triple
from rdflib.plugins.sparql.parserutils import CompValue

from irtwin.knowledge.rdflib_terms import from_rdflib
from irtwin.knowledge.rules.conjunction import algebra
from irtwin.knowledge.rules.rule import Rule, group_of
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.sparql_text import masked

_Term = NamedNode | BlankNode | Literal | Triple
_Bound = dict[str, _Term]

MOST_TAKEN = 1_000  # solutions of a subquery
_SELECT = re.compile(r"\bSELECT\b([^{]*)\{", re.IGNORECASE)
_IN_BRACKETS = re.compile(r"\([^()]*\)")
_VARIABLE = re.compile(r"[?$](\w+)")


def premises(graph: KnowledgeGraph, rule: Rule, conclusion: Triple) -> tuple[list[Triple], bool] | None:
    """Return the facts that a rule drew a conclusion from, and whether these are all; None where it did not.

    Of several ways to conclude it, the first that is found. A subquery, as sums have, took all that fits it; of that,
    MOST_TAKEN solutions are read. What must be absent for the rule to hold is not among the facts, nor what lies
    between the ends of a property path.
    """
    prologue, body = group_of(rule)
    for pattern in algebra(rule.construct).template:
        bound = _unified(pattern, conclusion)
        for known in _solutions(graph, prologue, body, bound, 1) if bound is not None else ():
            instances = dict.fromkeys(_taken(graph, prologue, body, [known], known))
            facts = [
                triple for triple in instances if triple is not None and triple != conclusion and graph.holds(triple)
            ]
            return facts, None not in instances
    return None


def _taken(
    graph: KnowledgeGraph, prologue: str, body: str, solutions: Iterable[_Bound], known: _Bound
) -> Iterator[Triple | None]:
    """Yield what the patterns of a group are in its solutions, and those of its subqueries; None for what is left out.

    `known` are the values that hold for all of the solutions.
    """
    patterns = list(_patterns(algebra(f"{prologue} SELECT * WHERE {{ {body} }}").p))
    for number, solution in enumerate(solutions if patterns else ()):
        if number == MOST_TAKEN:
            yield None
            break
        for pattern in patterns:
            terms = [_value(term, solution) for term in pattern]
            if None not in terms:
                yield Triple(*terms)  # type: ignore[arg-type]
    for names, group in _subqueries(body):
        told = {name: value for name, value in known.items() if name in names}
        yield from _taken(graph, prologue, group, _solutions(graph, prologue, group, told, MOST_TAKEN + 1), told)


def _solutions(graph: KnowledgeGraph, prologue: str, body: str, bound: _Bound, most: int) -> Iterator[_Bound]:
    """Yield the values of a group's variables where some of them are bound."""
    made = {name for name in bound if re.search(rf"\bAS\s+[?$]{name}\b", body, re.IGNORECASE)}
    before = " ".join(f"VALUES ?{name} {{ {value} }}" for name, value in bound.items() if name not in made)
    after = " ".join(f"FILTER(sameTerm(?{name}, {bound[name]}))" for name in made)
    text = f"{prologue} SELECT * WHERE {{ {before} {body} {after} }} LIMIT {most}"
    answers = cast(QuerySolutions, graph.answer(text))
    names = [variable.value for variable in answers.variables]
    for row in answers:
        yield {name: value for name, value in zip(names, row, strict=True) if value is not None} | bound


def _subqueries(body: str) -> Iterator[tuple[set[str], str]]:
    """Yield the outermost subqueries of a group: the variables that each hands on as they are, and its own group."""
    text, end = masked(body), 0
    for select in _SELECT.finditer(text):
        if select.start() < end:
            continue
        depth, end = 1, select.end()
        while depth:
            depth += {"{": 1, "}": -1}.get(text[end], 0)
            end += 1
        clause = body[select.start(1) : select.end(1)]
        while clause != (clause := _IN_BRACKETS.sub(" ", clause)):
            pass
        group = body[select.end() : end - 1]
        yield set(_VARIABLE.findall(group if "*" in clause else clause)), group


def _patterns(algebra: Any) -> Iterator[tuple[Any, Any, Any]]:
    """Yield the triple patterns of a query, but those of its filters and subqueries."""
    if not isinstance(algebra, CompValue) or algebra.name == "ToMultiSet":
        return
    yield from algebra.get("triples") or ()
    for name, part in algebra.items():
        if name != "expr":
            for inner in part if isinstance(part, list) else [part]:
                yield from _patterns(inner)


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
