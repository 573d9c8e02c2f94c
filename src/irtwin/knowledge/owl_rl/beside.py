"""The closure of facts that do not model beside an ontology: what `Closure` finds, by tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from pyoxigraph import Triple

from irtwin.knowledge.owl_rl.closure import Closure, is_hidden
from irtwin.knowledge.owl_rl.program import program
from irtwin.knowledge.owl_rl.rules import Fact, Facts
from irtwin.knowledge.owl_rl.schema import OBJECT, SUBJECT, Schema


class Equality(Exception):
    """Two terms are the same: what follows of that is not in an ontology's table."""


class Beside(Closure):
    """Facts and what follows of them beside a closed ontology, but nothing that follows from the ontology alone.

    What the facts may say is told in `irtwin.knowledge.parts`: statements that model are not followed. Raises Equality
    where terms are the same, and Contradiction as `Closure` does.
    """

    def __init__(self, schema: Schema, triples: Iterable[Triple]):
        self._schema = schema
        self._program = program()
        self._terms = schema.closure.terms.copy()
        self._facts = schema.closure.facts.copy()
        self._new = Facts()
        self._of_ontology = schema.closure.known
        self._first = len(self._terms.forms)
        self._drawn = self._rounds = 0
        self._round: dict[Fact, int] = {}
        self._triples: set[Triple] = set()
        self._given: set[Fact] = set()
        self.add(triples)

    def add(self, triples: Iterable[Triple]) -> None:
        """Take more triples as given, and infer what follows of them."""
        self._new = Facts()
        super().add(triples)

    def worth_keeping(self) -> set[Triple]:
        """Return what follows and is worth keeping in a graph, as `Closure` has it."""
        terms, helpers = self._terms, self._helpers()
        own = range(self._first, len(terms.forms))
        hidden = self._schema.hidden.union(number for number in own if is_hidden(terms.forms[number][0]))
        kept: set[Triple] = set()
        for fact in self._round.keys() - self._given:
            subject, predicate, object = fact
            if subject not in hidden and object not in hidden and predicate not in helpers:
                kept.update(list(terms.triples(fact))[:1])
        return kept

    def _saturate(self, facts: Iterable[Fact]) -> None:
        fresh = self._unknown(facts)
        while fresh:
            self._follow(fresh)
            new = Facts(fresh)
            for fact in fresh:
                self._facts.add(fact)
                self._new.add(fact)
            fresh = self._unknown(fact for join in self._schema.joins for fact in join(self._facts, new))

    def _follow(self, fresh: list[Fact]) -> None:
        """Add what follows from each of some facts alone, and from what follows, to them."""
        table, known, of_ontology = self._schema.table, self._round, self._of_ontology
        for subject, predicate, object in fresh:  # which grows
            for key in (predicate, (predicate, object)):
                for s, p, o in table.get(key, ()):
                    fact = (
                        subject if s == SUBJECT else object if s == OBJECT else s,
                        p,
                        subject if o == SUBJECT else object if o == OBJECT else o,
                    )
                    if fact not in known and fact not in of_ontology:
                        known[fact] = 0
                        fresh.append(fact)

    def _unknown(self, facts: Iterable[Fact]) -> list[Fact]:
        same = self._program.same
        unknown = super()._unknown(fact for fact in facts if fact not in self._of_ontology)
        if any(fact[1] == same and fact[0] != fact[2] for fact in unknown):
            raise Equality
        return unknown

    def _types_of_mentioned(self) -> Iterator[Fact]:
        if self._schema.reads_values:
            yield from super()._types_of_mentioned()

    def _add_reflexives(self) -> None:
        """Leave out that x is itself: nothing is said of owl:sameAs."""

    def _refuse_contradictions(self) -> None:
        for rule, join in self._schema.contradictions:
            self._refuse(rule, join(self._facts, self._new))
        self._refuse_other_datatypes(self._new)
