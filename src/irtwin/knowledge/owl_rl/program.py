"""The rules of OWL 2 RL, compiled: forward to what follows from new facts, backward to what a fact follows from."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache

from pyoxigraph import NamedNode

from irtwin.knowledge.owl_rl import datatypes
from irtwin.knowledge.owl_rl.rules import (
    DatalogRule,
    Fact,
    Facts,
    Join,
    Number,
    Pattern,
    Term,
    compile_join,
    read_rules,
)
from irtwin.knowledge.owl_rl.terms import Terms
from irtwin.knowledge.store.rdf_input import read_turtle
from irtwin.knowledge.vocabulary import PREFIXES, XSD
from irtwin.resources import folder

_SPACES = {**PREFIXES, "rl": "urn:irtwin:owl2-rl:"}
_BY_GROUPS = ("eq-sym", "eq-trans")  # run by joining groups: as loops they take time with the cube of a group
_OF_FACTS = ("owl:sameAs", "rl:in_all")
_NUMBERS = {"rl:zero": "0", "rl:one": "1"}


@cache
def program() -> Program:
    """Return the rules of `rules/owl2_rl.rq`, compiled once."""
    return Program()


class Program:
    """The rules, compiled for numbers that every closure begins with."""

    def __init__(self) -> None:
        self.terms = Terms()
        for name, text in _NUMBERS.items():
            self.terms.reserve(_node(name), datatypes.value(text, XSD + "integer"))
        axioms = sorted(read_turtle(folder("rules") / "owl2_rl_axioms.ttl"), key=str)
        self.axioms = self.terms.facts(axioms)
        self.type, self.same, self.different = map(self.number, ("rdf:type", "owl:sameAs", "owl:differentFrom"))
        self.rules = read_rules(folder("rules") / "owl2_rl.rq")
        self.helpers = {
            self.number(term)
            for rule in self.rules
            for pattern in rule.head
            for term in pattern
            if term.startswith("rl:")
        }
        self.forward = [
            compile_join(rule, self.number, rule.head, new=index)
            for rule in self.rules
            if rule.head and rule.name not in _BY_GROUPS
            for index in range(len(rule.body))
        ]
        self.contradictions = [
            (rule, compile_join(rule, self.number, [rule.culprits])) for rule in self.rules if rule.culprits
        ]

    def terms_of_models(self) -> tuple[set[str], set[str]]:
        """Return the IRIs of properties and of classes by whose use an ontology tells the rules what to conclude."""
        body = [pattern for rule in self.rules for pattern in rule.body]
        properties = {predicate for _, predicate, _ in body if not predicate.startswith(("?", "rl:"))} - {"rdf:type"}
        classes = {kind for _, predicate, kind in body if predicate == "rdf:type" and not kind.startswith("?")}
        return ({_node(name).value for name in properties}, {_node(name).value for name in classes})

    def is_of_models(self, pattern: Pattern) -> bool:
        """Whether a pattern fits what an ontology says of its classes and properties, and nothing else."""
        _, predicate, kind = pattern
        if predicate == "rdf:type":
            return not kind.startswith("?")
        return not predicate.startswith("?") and predicate not in _OF_FACTS

    def number(self, term: Term) -> Number:
        """Return the number of a term of the rules."""
        return self.terms.number(_node(term))

    def concluding(self, conclusion: Fact) -> Iterator[tuple[DatalogRule, Join, list[Number]]]:
        """Return the rules that may draw a conclusion, and how to ask each for its premises."""
        for rule in self.rules:
            for pattern in rule.head:
                bound = self._unified(pattern, conclusion)
                if bound is not None:
                    yield rule, self._backward(rule, tuple(bound)), list(bound.values())

    def clashes(self, rule: DatalogRule, culprits: Sequence[Number], facts: Facts) -> Iterator[list[Fact]]:
        """Yield what a rule that finds a contradiction finds it by, each time that it shows these culprits."""
        for values in self._backward(rule, rule.culprits)(facts, facts, *culprits):
            yield self.premises(rule, values)

    def premises(self, rule: DatalogRule, values: Sequence[Number]) -> list[Fact]:
        """Return the body of a rule with numbers for its variables."""
        bound = dict(zip(rule.variables, values, strict=True))
        return [
            (self._value(subject, bound), self._value(predicate, bound), self._value(object, bound))
            for subject, predicate, object in rule.body
        ]

    def _value(self, term: Term, bound: dict[Term, Number]) -> Number:
        return bound[term] if term.startswith("?") else self.number(term)

    def _unified(self, pattern: Pattern, fact: Fact) -> dict[Term, Number] | None:
        bound: dict[Term, Number] = {}
        for term, number in zip(pattern, fact, strict=True):
            if (bound.setdefault(term, number) if term.startswith("?") else self.number(term)) != number:
                return None
        return bound

    def _backward(self, rule: DatalogRule, given: tuple[Term, ...]) -> Join:
        variables = [term for term in given if term.startswith("?")]
        return compile_join(rule, self.number, [rule.variables], given=variables)


def _node(term: Term) -> NamedNode:
    prefix, name = term.split(":")
    return NamedNode(_SPACES[prefix] + name)
