"""What a rule's SPARQL says where it only joins facts and compares their values: patterns, comparisons, a template."""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache
from typing import Any

import rdflib
from rdflib.plugins.sparql.algebra import translateQuery
from rdflib.plugins.sparql.parser import parseQuery
from rdflib.plugins.sparql.parserutils import CompValue

from irtwin.knowledge.vocabulary import PREFIXES

TURNED = {">": "<", "<": ">", ">=": "<=", "<=": ">="}

_WORDS = {
    "LeftJoin": "OPTIONAL", "Union": "UNION", "Minus": "MINUS", "Extend": "BIND", "AggregateJoin": "sums over facts",
    "Group": "sums over facts", "ToMultiSet": "subqueries or VALUES", "Graph": "GRAPH", "Builtin_EXISTS": "EXISTS",
    "Builtin_NOTEXISTS": "NOT EXISTS", "ConditionalOrExpression": "alternatives (||)",
}  # fmt: skip

Pattern = tuple[Any, Any, Any]  # of rdflib's terms and paths
Comparison = tuple[Any, str, Any]  # variable or value, sign, variable or value


class NoConjunction(Exception):
    """Why a rule is more than facts and comparisons that all hold."""


def conjunction(construct: str) -> tuple[list[Pattern], list[Comparison], list[Pattern]]:
    """Return the patterns and comparisons of a CONSTRUCT that all hold, and the template of what then follows.

    NoConjunction where it is more.
    """
    query = algebra(construct)
    return *_conjuncts(query.p), list(query.template)


@lru_cache(maxsize=256)  # rdflib takes a tenth of a second a rule, and the rules are those of the last time
def algebra(construct: str) -> Any:
    """Return the algebra of a rule's CONSTRUCT, as rdflib reads it."""
    return translateQuery(parseQuery(construct), initNs=PREFIXES).algebra


def _conjuncts(node: Any) -> tuple[list[Pattern], list[Comparison]]:
    """Return the triple patterns and comparisons that a query's WHERE is made of."""
    if node.name in ("Project", "Distinct"):
        return _conjuncts(node.p)
    if node.name == "BGP":
        return list(node.triples), []
    if node.name == "Join":
        (first, of_first), (second, of_second) = _conjuncts(node.p1), _conjuncts(node.p2)
        return first + second, of_first + of_second
    if node.name == "Filter":
        patterns, comparisons = _conjuncts(node.p)
        return patterns, comparisons + list(_comparisons(node.expr))
    raise NoConjunction(f"SWRL has no {_WORDS.get(node.name, node.name)}")


def _comparisons(expression: Any) -> Iterator[Comparison]:
    if getattr(expression, "name", "") == "ConditionalAndExpression":
        for part in (expression.expr, *expression.other):
            yield from _comparisons(part)
        return
    if getattr(expression, "name", "") != "RelationalExpression":
        word = getattr(expression, "name", "such a FILTER")
        raise NoConjunction(f"SWRL has no {_WORDS.get(word, word.removeprefix('Builtin_'))}")
    left, sign, right = expression.expr, expression.op, expression.other
    if any(isinstance(end, CompValue) for end in (left, right)):
        raise NoConjunction("it reckons, and HermiT takes no built-ins")
    if sign not in TURNED:
        raise NoConjunction(f"HermiT takes no built-ins, and no class compares by {sign}")
    yield (left, sign, right)


def joined_to(start: rdflib.Variable, patterns: list[Pattern]) -> list[Pattern]:
    """Return the patterns that common variables join to one."""
    reached, size = {start}, 0
    while size < len(reached):
        size = len(reached)
        for pattern in patterns:
            variables = {term for term in pattern if isinstance(term, rdflib.Variable)}
            if variables & reached:
                reached |= variables
    return [pattern for pattern in patterns if any(term in reached for term in pattern)]
