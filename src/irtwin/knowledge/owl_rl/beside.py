"""The closure of facts that do not model beside an ontology: what `Closure` finds, by tables.

Facts of one predicate, or of one type, lead to conclusions of one kind: they are held and followed together, as sets.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from collections.abc import Set as AbstractSet
from typing import Any

from pyoxigraph import NamedNode, Triple

from irtwin.knowledge.owl_rl import datatypes
from irtwin.knowledge.owl_rl.closure import contradiction, is_hidden, not_of, show
from irtwin.knowledge.owl_rl.program import program
from irtwin.knowledge.owl_rl.rules import Fact, Facts, Number
from irtwin.knowledge.owl_rl.schema import OBJECT, SUBJECT, Key, Schema
from irtwin.knowledge.owl_rl.terms import Terms

Groups = dict[Key, set[Any]]  # subjects by predicate and object, or pairs of subject and object by predicate


class Equality(Exception):
    """Two terms are the same: what follows of that is not in an ontology's table."""


class Beside:
    """Facts and what follows of them beside a closed ontology, but nothing that follows from the ontology alone.

    What the facts may say is told in `irtwin.knowledge.parts`: statements that model are not followed. Raises Equality
    where terms are the same, and Contradiction as `Closure` does.
    """

    def __init__(self, schema: Schema, triples: Iterable[Triple]):
        self._schema = schema
        self._type, self._same = program().type, program().same
        self._terms = schema.closure.terms.copy()
        self._first = len(self._terms.forms)
        self._facts = schema.closure.facts.copy(schema.looked_at)  # for loops alone, as are the next
        self._new = Facts()
        self._triples: set[Triple] = set()
        self._given: Groups = {}
        self._known: Groups = {}
        self._followed: Groups = {}  # since the joins were last looked at
        self._waiting: Groups = {}  # known, and to be followed
        self.add(triples)

    def add(self, triples: Iterable[Triple]) -> None:
        """Take more triples as given, and infer what follows of them."""
        more = set(triples) - self._triples
        self._triples |= more
        self._new = Facts()
        given = self._grouped(self._terms.facts(more))
        self._refuse_ill_typed()
        for key, some in given.items():
            self._given.setdefault(key, set()).update(some)
            self._put(key, some)
        if self._schema.reads_values:
            self._type_values()
        self._saturate()
        self._refuse_contradictions()

    @property
    def known(self) -> Groups:
        """All that is known beside the ontology: subjects by predicate and object, or pairs by predicate."""
        return self._known

    @property
    def terms(self) -> Terms:
        """The numbers of terms."""
        return self._terms

    def worth_keeping(self) -> set[Triple]:
        """Return what follows and is worth keeping in a graph, as `Closure` has it."""
        forms: list[Any] = self._terms.forms
        literals, helpers = self._terms.literals, self._schema.helpers
        own = range(self._first, len(forms))
        hidden = self._schema.hidden.union(number for number in own if is_hidden(forms[number][0]))
        kept: set[Triple] = set()
        for key, facts in self._known.items():
            predicate, object = key if isinstance(key, tuple) else (key, None)
            new = facts - self._given.get(key, set())
            if not new or predicate in helpers or predicate in literals or object in hidden:
                continue
            property = forms[predicate][0]
            if object is not None:
                kind = forms[object][0]
                kept.update([Triple(forms[it][0], property, kind) for it in new - hidden - literals])
            else:
                kept.update(
                    [
                        Triple(forms[one][0], property, forms[other][0])
                        for one, other in new
                        if one not in hidden and one not in literals and other not in hidden
                    ]
                )
        return kept

    def _grouped(self, facts: Iterable[Fact]) -> Groups:
        by_object, groups = self._schema.by_object, Groups()
        for subject, predicate, object in facts:
            if predicate in by_object:
                groups.setdefault((predicate, object), set()).add(subject)
            else:
                groups.setdefault(predicate, set()).add((subject, object))
        return groups

    def _put(self, key: Key, facts: AbstractSet[Any]) -> None:
        """Note facts that were found, and let those that are new be followed."""
        known = self._known.get(key)
        new = facts - self._schema.known(key) if known is None else facts - known - self._schema.known(key)
        if not new:
            return
        if key == self._same and any(one != other for one, other in new):
            raise Equality
        self._known.setdefault(key, set()).update(new)
        self._waiting.setdefault(key, set()).update(new)

    def _put_pairs(self, predicate: Number, pairs: AbstractSet[tuple[Number, Number]]) -> None:
        if predicate in self._schema.by_object:
            for key, some in self._grouped((one, predicate, other) for one, other in pairs).items():
                self._put(key, some)
        else:
            self._put(predicate, pairs)

    def _put_subjects(self, predicate: Number, object: Number, subjects: AbstractSet[Number]) -> None:
        if predicate in self._schema.by_object:
            self._put((predicate, object), subjects)
        else:
            self._put(predicate, {(one, object) for one in subjects})

    def _saturate(self) -> None:
        while self._waiting:
            while self._waiting:
                key = next(iter(self._waiting))
                new = self._waiting.pop(key)
                self._followed.setdefault(key, set()).update(new)
                if isinstance(key, tuple):
                    self._follow_subjects(key, new)
                else:
                    self._follow_pairs(key, new)
            self._join()

    def _follow_subjects(self, key: tuple[Number, Number], subjects: set[Number]) -> None:
        table, (predicate, end) = self._schema.table, key
        for s, p, o in (*table.get(key, ()), *table.get(predicate, ())):
            if s == SUBJECT and o not in (SUBJECT, OBJECT):
                self._put_subjects(p, o, subjects)
            else:
                of_end = {SUBJECT: None, OBJECT: end}
                one, other = of_end.get(s, s), of_end.get(o, o)
                self._put_pairs(p, {(it if one is None else one, it if other is None else other) for it in subjects})

    def _follow_pairs(self, predicate: Number, pairs: set[tuple[Number, Number]]) -> None:
        conclusions = self._schema.table.get(predicate)
        if not conclusions:
            return
        ends = {SUBJECT: {one for one, _ in pairs}, OBJECT: {other for _, other in pairs}}
        for s, p, o in conclusions:
            if s in ends and o not in ends:
                self._put_subjects(p, o, ends[s])
            elif (s, o) == (SUBJECT, OBJECT):
                self._put_pairs(p, pairs)
            else:
                at = {SUBJECT: 0, OBJECT: 1}
                self._put_pairs(p, {(pair[at[s]] if s in at else s, pair[at[o]] if o in at else o) for pair in pairs})

    def _join(self) -> None:
        """Note what follows from several facts, of which some were followed since this was last asked."""
        followed, self._followed = self._followed, {}
        for predicate, end in self._schema.single:
            if predicate in followed or predicate in self._schema.by_object:
                self._refuse_several(predicate, end)
        if self._schema.looked_at:
            new = Facts(list(self._looked_at(followed)))
            for fact in new:
                self._facts.add(fact)
                self._new.add(fact)
            for key, some in self._grouped(
                fact for join in self._schema.joins for fact in join(self._facts, new)
            ).items():
                self._put(key, some)

    def _refuse_several(self, predicate: Number, end: int) -> None:
        """Raise Equality where several objects of a subject (or the other way round) are to be one."""
        pairs = set(self._schema.known(predicate))
        if predicate in self._schema.by_object:
            keys = (key for key in self._known if isinstance(key, tuple) and key[0] == predicate)
            pairs.update((it, key[1]) for key in keys for it in self._known[key])
        else:
            pairs |= self._known.get(predicate, set())
        if len({pair[0 if end == SUBJECT else 1] for pair in pairs}) < len(pairs):
            raise Equality

    def _looked_at(self, groups: Groups) -> Iterator[Fact]:
        """Yield the facts that loops look at."""
        looked_at = self._schema.looked_at
        for key, facts in groups.items():
            predicate, end = key if isinstance(key, tuple) else (key, None)
            objects = looked_at.get(predicate, set()) | looked_at.get(None, set())
            if end is not None:
                if None in objects or end in objects:
                    yield from ((one, predicate, end) for one in facts)
            elif objects:
                yield from ((one, predicate, it) for one, it in facts if None in objects or it in objects)

    def _type_values(self) -> None:
        """Say of each literal which datatypes contain it (dt-type2)."""
        numbers = {iri: self._terms.number(NamedNode(iri)) for iri in datatypes.names()}
        for number, value in self._terms.values.items():
            for iri in datatypes.datatypes_of(value):
                self._put((self._type, numbers[iri]), {number})

    def _refuse_ill_typed(self) -> None:
        for literal in self._terms.ill_typed:
            raise not_of(self._use(self._terms.number(literal)), literal.datatype.value)

    def _refuse_contradictions(self) -> None:
        for rule, join in self._schema.contradictions:
            for culprits in join(self._facts, self._new):
                raise contradiction(rule.name, ", ".join(map(self._name, culprits)))
        for key, some in self._known.items():
            if isinstance(key, tuple) and key[0] == self._type and datatypes.is_datatype(iri := self._iri(key[1])):
                for number in some & self._terms.values.keys():  # dt-not-type
                    if iri not in datatypes.datatypes_of(self._terms.values[number]):
                        raise not_of(self._use(number), iri)

    def _use(self, number: Number) -> str:
        """Return a given triple, as people write it, whose object has the number."""
        triple = next(it for it in self._triples if self._terms.number(it.object) == number)
        return " ".join(map(show, triple))

    def _iri(self, number: Number) -> str:
        return str(getattr(self._terms.forms[number][0], "value", "")) if number not in self._terms.literals else ""

    def _name(self, number: Number) -> str:
        return show(self._terms.forms[number][0])
