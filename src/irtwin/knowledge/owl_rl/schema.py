"""An ontology that is closed once, and what its rules then say of facts beside it.

Nearly all that OWL 2 RL concludes of individuals follows from one fact and the ontology: a type of a domain, an
inverse, a class above a class. It is the same for all facts with that predicate, or of that type, so it is worked out
once and kept as a table. What joins several facts stays a loop, as long as the ontology gives it anything to do.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pyoxigraph import Triple

from irtwin.knowledge.owl_rl import datatypes
from irtwin.knowledge.owl_rl.closure import Closure, is_hidden
from irtwin.knowledge.owl_rl.program import program
from irtwin.knowledge.owl_rl.rules import Fact, Join, Number, Pattern, Rule, Term, compile_join

SUBJECT, OBJECT = -1, -2  # in a conclusion of the table: the ends of the fact that it follows from
Key = Number | tuple[Number, Number]  # a predicate, or a predicate and an object


class Schema:
    """An ontology, closed. Contradiction where it contradicts itself.

    `table` are the conclusions from one fact, by its predicate, or by predicate and object; `joins` are the loops of
    the other rules, and `contradictions` those that find one. `reads_values` tells whether these ask of which
    datatypes a literal is. `unfit` says in words why facts cannot be closed by all that, None where they can: terms of
    the ontology are the same, and the rules of equality are left out here.
    """

    def __init__(self, triples: Iterable[Triple]):
        self._program = program()
        self.closure = Closure(triples)
        self.kept = self.closure.worth_keeping()
        forms = self.closure.terms.forms
        self.hidden = {number for number, terms in enumerate(forms) if terms and is_hidden(terms[0])}
        self.table: dict[Key, list[Fact]] = {}
        self.joins: list[Join] = []
        self.contradictions: list[tuple[Rule, Join]] = []
        self.reads_values = False
        self.unfit = next(self._equalities(), None)
        for rule in self._program.rules:
            if not any(predicate == "owl:sameAs" for _, predicate, _ in rule.body):
                self._take(rule)

    def _equalities(self) -> Iterator[str]:
        """Yield what the rules of equality would conclude from."""
        same = self._program.same
        for fact in self.closure.facts:
            if same in fact and fact[0] != fact[2]:
                yield self.closure.in_words(fact)

    def _take(self, rule: Rule) -> None:
        """Put what a rule concludes beside the ontology into the table, or its loops beside it."""
        of_facts = [index for index, pattern in enumerate(rule.body) if not self._program.is_of_models(pattern)]
        bindings = list(self._bindings(rule, of_facts)) if of_facts else []
        if not bindings:
            return
        if rule.head and len(of_facts) == 1:
            found = [self._conclusions(rule, rule.body[of_facts[0]], bound) for bound in bindings]
            if None not in found:
                for key, conclusions in filter(None, found):
                    self.table.setdefault(key, []).extend(conclusions)
                return
        kinds = {self._value(rule.body[index][2], bound) for index in of_facts for bound in bindings}
        self.reads_values |= any(self._is_datatype(kind) for kind in kinds)
        loops = [compile_join(rule, self._program.number, rule.head or [rule.culprits], new=at) for at in of_facts]
        if rule.head:
            self.joins += loops
        else:
            self.contradictions += [(rule, loop) for loop in loops]

    def _bindings(self, rule: Rule, of_facts: list[int]) -> Iterator[dict[Term, Number]]:
        """Yield the values that the ontology gives to variables of a rule."""
        patterns = tuple(pattern for index, pattern in enumerate(rule.body) if index not in of_facts)
        variables = {term for pattern in patterns for term in pattern}
        asked = Rule(rule.name, (), (), patterns, tuple(pair for pair in rule.unequal if variables.issuperset(pair)))
        facts = self.closure.facts
        for values in compile_join(asked, self._program.number, [asked.variables])(facts, facts):
            yield dict(zip(asked.variables, values, strict=True))

    def _conclusions(self, rule: Rule, pattern: Pattern, bound: dict[Term, Number]) -> tuple[Key, list[Fact]] | None:
        """Return a key of the table, and what a rule concludes from a fact of it; None where it is no such rule."""
        subject, predicate, object = (self._value(term, bound) for term in pattern)
        decided = all(term in bound for pair in rule.unequal for term in pair)
        if not isinstance(subject, str) or isinstance(predicate, str) or subject == object or not decided:
            return None
        ends = {subject: SUBJECT} | ({object: OBJECT} if isinstance(object, str) else {})
        if not isinstance(object, str) and self._is_datatype(object):
            self.reads_values |= not all(self._is_datatype(self._value(head[2], bound)) for head in rule.head)
        values = {term: self._value(term, bound) for head in rule.head for term in head}
        numbers = {term: ends[value] if isinstance(value, str) else value for term, value in values.items()}
        found = [(numbers[s], numbers[p], numbers[o]) for s, p, o in rule.head]
        return (predicate if isinstance(object, str) else (predicate, object)), found

    def _value(self, term: Term, bound: dict[Term, Number]) -> Number | Term:
        return bound.get(term, term) if term.startswith("?") else self._program.number(term)

    def _is_datatype(self, value: Number | Term) -> bool:
        return not isinstance(value, str) and datatypes.is_datatype(self.closure.iri(value))
