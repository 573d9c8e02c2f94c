"""An ontology that is closed once, and what its rules then say of facts beside it.

Nearly all that OWL 2 RL concludes of individuals follows from one fact and the ontology: a type of a domain, an
inverse, a class above a class. It is the same for all facts with that predicate, or of that type, so it is worked out
once and kept as a table. Of what joins several facts, properties with one value are kept apart. The rest stay loops, as
long as the ontology gives them anything to do.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pyoxigraph import Triple

from irtwin.knowledge.owl_rl import datatypes
from irtwin.knowledge.owl_rl.closure import Closure
from irtwin.knowledge.owl_rl.program import program
from irtwin.knowledge.owl_rl.rules import DatalogRule, Fact, Join, Number, Pattern, Term, compile_join

SUBJECT, OBJECT = -1, -2  # in a conclusion of the table: the ends of the fact that it follows from, 0 and 1 of a pair
Key = Number | tuple[Number, Number]  # a predicate, or a predicate and an object


class Schema:
    """An ontology, closed. Contradiction where it contradicts itself.

    `table` are the conclusions from one fact, by its predicate, or by predicate and object; `by_object` are the
    predicates of the latter. `single` are the predicates by which a subject has one object (SUBJECT), or an object one
    subject (OBJECT), and `one` what the ontology says of these. `joins` are the loops of the other rules, and
    `contradictions` those that find one; `looked_at` are the predicates of the facts that these loops look at, with the
    objects where these are known, and None for any. `datatypes` are those that rules ask for, by their IRIs. `unfit`
    says in words why facts cannot be closed by all that, None where they can: terms of the ontology are the same, and
    the rules of equality are left out here.
    """

    def __init__(self, triples: Iterable[Triple]):
        self._program = program()
        self.closure = Closure(triples)
        self.kept = self.closure.worth_keeping()
        self.table: dict[Key, list[Fact]] = {}
        self.single: dict[Number, set[int]] = {}
        self.joins: list[Join] = []
        self.contradictions: list[tuple[DatalogRule, Join]] = []
        self.looked_at: dict[Number | None, set[Number | None]] = {}
        self.datatypes: dict[str, Number] = {}
        self.unfit = next(self._equalities(), None)
        for rule in self._program.rules:
            if not any(predicate == "owl:sameAs" for _, predicate, _ in rule.body):
                self._take(rule)
        self.by_object = {key[0] for key in self.table if isinstance(key, tuple)}
        self.one = dict(self.values_of_single(self.closure.facts))

    def values_of_single(self, facts: Iterable[Fact]) -> Iterator[tuple[tuple[Number, int, Number], Number]]:
        """Yield the value that facts say, by predicate, which end has it, and of what, if there may be but one."""
        for subject, predicate, object in facts:
            for end in self.single.get(predicate, ()):
                yield ((predicate, end, subject), object) if end == SUBJECT else ((predicate, end, object), subject)

    def _equalities(self) -> Iterator[str]:
        """Yield what the rules of equality would conclude from."""
        same = self._program.same
        for fact in self.closure.facts:
            if same in fact and fact[0] != fact[2]:
                yield self.closure.in_words(fact)

    def _take(self, rule: DatalogRule) -> None:
        """Put what a rule concludes beside the ontology into a table, or its loops beside it."""
        of_facts = [index for index, pattern in enumerate(rule.body) if not self._program.is_of_models(pattern)]
        bindings = list(self._bindings(rule, of_facts)) if of_facts else []
        if not bindings:
            return
        patterns = [rule.body[index] for index in of_facts]
        if rule.head and len(of_facts) == 1:
            concluded = [self._conclusions(rule, patterns[0], bound) for bound in bindings]
            if None not in concluded:
                for key, conclusions in filter(None, concluded):
                    self.table.setdefault(key, []).extend(conclusions)
                return
        values = [[tuple(self._value(term, bound) for term in of_fact) for of_fact in patterns] for bound in bindings]
        self._ask(pattern[2] for of_one in values for pattern in of_one)
        single = [self._one_value(rule, patterns, of_one) for of_one in values]
        if None not in single:
            for one_value in filter(None, single):
                self.single.setdefault(one_value[0], set()).add(one_value[1])
            return
        for _, predicate, object in (pattern for of_one in values for pattern in of_one):
            looked_at = self.looked_at.setdefault(None if isinstance(predicate, str) else predicate, set())
            looked_at.add(None if isinstance(object, str) else object)
        loops = [compile_join(rule, self._program.number, rule.head or [rule.culprits], new=at) for at in of_facts]
        if rule.head:
            self.joins += loops
        else:
            self.contradictions += [(rule, loop) for loop in loops]

    def _bindings(self, rule: DatalogRule, of_facts: list[int]) -> Iterator[dict[Term, Number]]:
        """Yield the values that the ontology gives to variables of a rule."""
        patterns = tuple(pattern for index, pattern in enumerate(rule.body) if index not in of_facts)
        variables = {term for pattern in patterns for term in pattern}
        asked = DatalogRule(
            rule.name, (), (), patterns, tuple(pair for pair in rule.unequal if variables.issuperset(pair))
        )
        facts = self.closure.facts
        for values in compile_join(asked, self._program.number, [asked.variables])(facts, facts):
            yield dict(zip(asked.variables, values, strict=True))

    def _conclusions(
        self, rule: DatalogRule, pattern: Pattern, bound: dict[Term, Number]
    ) -> tuple[Key, list[Fact]] | None:
        """Return a key of the table, and what a rule concludes from a fact of it; None where it is no such rule."""
        subject, predicate, object = (self._value(term, bound) for term in pattern)
        decided = all(term in bound for pair in rule.unequal for term in pair)
        if not isinstance(subject, str) or isinstance(predicate, str) or subject == object or not decided:
            return None
        ends = {subject: SUBJECT} | ({object: OBJECT} if isinstance(object, str) else {})
        if not all(self._is_datatype(self._value(head[2], bound)) for head in rule.head):
            self._ask([object])
        values = {term: self._value(term, bound) for head in rule.head for term in head}
        numbers = {term: ends[value] if isinstance(value, str) else value for term, value in values.items()}
        facts = [(numbers[s], numbers[p], numbers[o]) for s, p, o in rule.head]
        return (predicate if isinstance(object, str) else (predicate, object)), facts

    def _one_value(
        self, rule: DatalogRule, patterns: list[Pattern], values: list[tuple[Number | Term, ...]]
    ) -> tuple[Number, int] | None:
        """Return the predicate of which a rule allows one object, or one subject; None where it is no such rule."""
        if len(patterns) != 2 or len(rule.head) != 1 or rule.head[0][1] != "owl:sameAs":
            return None
        (s, predicate, o), (t, other, u) = values
        if isinstance(predicate, str) or predicate != other or not all(isinstance(end, str) for end in (s, o, t, u)):
            return None
        ends = {(rule.head[0][0], rule.head[0][2])}
        if s == t and o != u and ends == {(o, u)} == set(rule.unequal):
            return predicate, SUBJECT
        if o == u and s != t and ends == {(s, t)} == set(rule.unequal):
            return predicate, OBJECT
        return None

    def _value(self, term: Term, bound: dict[Term, Number]) -> Number | Term:
        return bound.get(term, term) if term.startswith("?") else self._program.number(term)

    def _ask(self, values: Iterable[Number | Term]) -> None:
        """Note the datatypes among some values, of which literals are to be told whether they contain them."""
        numbers = (value for value in values if not isinstance(value, str) and self._is_datatype(value))
        self.datatypes |= {self.closure.iri(number): number for number in numbers}

    def _is_datatype(self, value: Number | Term) -> bool:
        return not isinstance(value, str) and datatypes.is_datatype(self.closure.iri(value))
