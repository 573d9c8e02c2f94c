"""The closure of facts that do not model beside an ontology: what `Closure` finds, by tables."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import chain, islice

from pyoxigraph import Triple

from irtwin.knowledge.owl_rl import datatypes
from irtwin.knowledge.owl_rl.closure import Closure, contradiction
from irtwin.knowledge.owl_rl.rules import Fact, Facts, Number
from irtwin.knowledge.owl_rl.schema import OBJECT, SUBJECT, Key, Schema


class Equality(Exception):
    """Two terms are the same: what follows of that is not in an ontology's table."""


class FactsClosure(Closure):
    """Facts and what follows of them beside a closed ontology, but nothing that follows from the ontology alone.

    What the facts may say is told in `irtwin.knowledge.parts`: statements that model are not followed. Raises Equality
    where terms are the same, and Contradiction as `Closure` does. How something was inferred it does not tell.
    """

    def __init__(self, schema: Schema, triples: Iterable[Triple]):
        of_ontology = schema.closure
        self._begin(of_ontology.terms.copy(), of_ontology.facts.copy(schema.looked_at), of_ontology.known)
        self._schema, self._one, self._typed = schema, dict(schema.one), 0
        self.add(triples)

    def add(self, triples: Iterable[Triple]) -> int:
        """Take more triples as given, and infer what follows of them; return the last round before."""
        before, facts = self._rounds, self._taken(triples)
        self._saturate([*facts, *self._types_of_values()])
        return before

    def _saturate(self, facts: Iterable[Fact]) -> None:
        fresh = self._unknown(facts)
        while fresh:
            self._rounds += 1
            self._refuse_equal(fresh)
            new = Facts(self._looked_at(fresh))
            for fact in new:
                self.facts.add(fact)
            self._refuse_clashes(fresh, new)
            by_joins = (fact for join in self._schema.joins for fact in join(self.facts, new))
            fresh = self._unknown(chain(self._of_one(fresh), by_joins))

    def _of_one(self, fresh: list[Fact]) -> Iterator[Fact]:
        """Yield what follows from one fact; of all facts with a predicate, or of a type, the same does."""
        table, by_object = self._schema.table, self._schema.by_object
        ends: dict[Key, list[tuple[Number, Number]]] = {}
        for subject, predicate, object in fresh:
            ends.setdefault(predicate, []).append((subject, object))
            if predicate in by_object:
                ends.setdefault((predicate, object), []).append((subject, object))
        for key in ends.keys() & table.keys():
            of_end = {SUBJECT: {end for end, _ in ends[key]}, OBJECT: {end for _, end in ends[key]}}
            for s, p, o in table[key]:
                if o not in of_end:
                    yield from [(end, p, o) for end in of_end[s]]
                elif s not in of_end:
                    yield from [(s, p, end) for end in of_end[o]]
                else:
                    at, to = -1 - s, -1 - o
                    yield from [(pair[at], p, pair[to]) for pair in ends[key]]

    def _looked_at(self, fresh: list[Fact]) -> list[Fact]:
        """Return the facts that loops look at."""
        looked_at = self._schema.looked_at
        always = looked_at.get(None, set())
        if None in always:
            return fresh
        return [
            fact
            for fact in fresh
            if fact[2] in always or ((some := looked_at.get(fact[1])) and (None in some or fact[2] in some))
        ]

    def _types_of_values(self) -> Iterator[Fact]:
        """Say of each new literal which of the datatypes that rules ask for contain it (dt-type2)."""
        values, asked = self.terms.values, self._schema.datatypes
        if asked:
            for number, value in list(islice(values.items(), self._typed, None)):
                for iri in datatypes.datatypes_of(value) & asked.keys():
                    yield (number, self._program.type, asked[iri])
            self._typed = len(values)

    def _refuse_equal(self, fresh: list[Fact]) -> None:
        """Raise Equality where two terms are the same, or are to be as a property has one value."""
        same, single = self._program.same, self._one
        if any(predicate == same and subject != object for subject, predicate, object in fresh):
            raise Equality
        for of_what, value in self._schema.values_of_single(fresh):
            if single.setdefault(of_what, value) != value:
                raise Equality

    def _refuse_clashes(self, fresh: list[Fact], new: Facts) -> None:
        for rule, join in self._schema.contradictions:
            for culprits in join(self.facts, new):
                raise contradiction(rule.name, ", ".join(map(self._name, culprits)))
        values = self.terms.values
        self._refuse_other_datatypes(
            Facts([fact for fact in fresh if fact[0] in values and fact[1] == self._program.type])
        )
