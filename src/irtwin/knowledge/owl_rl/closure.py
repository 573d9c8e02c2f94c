"""The OWL 2 RL closure: the W3C's rules, run over what is new until nothing is."""

from __future__ import annotations

import copy
from collections.abc import Container, Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from itertools import chain, product
from typing import Self

from pyoxigraph import Literal, NamedNode, Triple

from irtwin.errors import InputError
from irtwin.knowledge.owl_rl import datatypes
from irtwin.knowledge.owl_rl.program import program
from irtwin.knowledge.owl_rl.rules import DatalogRule, Fact, Facts, Number
from irtwin.knowledge.owl_rl.terms import Node, Terms, is_hidden
from irtwin.knowledge.vocabulary import ID, OWL, RDFS, XSD, shorten

_REFLEXIVE = (  # what everything, every class or every property is to itself
    *(OWL + "sameAs", OWL + "equivalentClass", OWL + "equivalentProperty"),
    *(RDFS + "subClassOf", RDFS + "subPropertyOf"),
)
MOST_CONCLUSIONS = 100_000_000  # each time that a rule draws one counts
MOST_FACTS = 5_000_000  # beside those that were given; they take 1.1 GB


Statement = tuple[Node, Node, Node]  # unlike a triple, it may be about a literal


class Contradiction(InputError):
    """The graph contradicts itself: the rule that says so, and the terms it says it of.

    `given` are the triples that it follows from, and those of others that were found with it, where the engine tells.
    """

    def __init__(self, message: str, given: Iterable[Triple] = ()) -> None:
        super().__init__(message)
        self.given = frozenset(given)


@dataclass(frozen=True)
class Derivation:
    """A conclusion's rule, by the W3C's name, and the premises that it was drawn from."""

    rule: str
    premises: tuple[Statement, ...]


class Closure:
    """Triples and all that OWL 2 RL infers from them. Contradiction names the first rule that finds one.

    `terms` are the numbers of terms; `facts` is all that is known, but that x is itself; `known` says of all of it in
    which round it was found.
    """

    def __init__(self, triples: Iterable[Triple]):
        self._begin(program().terms.copy(), Facts())
        self._saturate(self._program.axioms)
        self.add(triples)

    def _begin(self, terms: Terms, facts: Facts, before: Container[Fact] = frozenset()) -> None:
        """Know nothing yet, but what was known `before`."""
        self._program = program()
        self.terms, self.facts, self._before = terms, facts, before
        self._drawn = 0
        self._rounds = 0
        self.known: dict[Fact, int] = {}  # and its round: a conclusion is found after its premises
        self._groups: dict[Number, set[Number]] = {}  # of numbers that are the same
        self._named_values: set[Number] = set()
        self._triples: set[Triple] = set()
        self._given: set[Fact] = set()

    def add(self, triples: Iterable[Triple]) -> int:
        """Take more triples as given, and infer what follows of them; return the last round before."""
        before, facts = self._rounds, self._taken(triples)
        self._saturate([*facts, *self._types_of_mentioned()])
        self._add_reflexives()
        self._refuse_contradictions()
        return before

    def _taken(self, triples: Iterable[Triple]) -> list[Fact]:
        """Return what of the triples was not given before."""
        more = set(triples) - self._triples
        self._triples |= more
        facts = self.terms.facts(more)
        self._given.update(facts)
        self._refuse_ill_typed()
        return facts

    def copy(self) -> Self:
        """Return the same, to be added to apart."""
        other = copy.copy(self)
        other.terms, other.facts = self.terms.copy(), self.facts.copy((None,))
        other.known, other._groups = dict(self.known), copy.deepcopy(self._groups)
        other._named_values, other._triples = set(self._named_values), set(self._triples)
        other._given = set(self._given)
        return other

    def inferred(self) -> Iterator[Triple]:
        """Return every triple that follows and was not given. What RDF cannot write, of literals, is left out."""
        helpers, forms = self.helpers(), self.terms.forms
        for fact in self.known:
            if fact not in self._given and fact[1] not in helpers:
                yield from self.terms.triples(fact)
            elif len(forms[fact[2]]) > 1:  # a given value in the other ways that literals write it
                yield from (triple for triple in self.terms.triples(fact) if triple not in self._triples)

    def worth_keeping(self, after: int = -1) -> set[Triple]:
        """Return what follows and is worth keeping in a graph; of that what was found after a round.

        Left out is what holds of everything (x sameAs x, C subClassOf C or owl:Thing), what is inferred of anonymous
        class expressions and of datatypes, and one more way to write a literal that stands there already.
        """
        terms, hidden, helpers = self.terms, self.terms.hidden, self.helpers()
        reflexive = {terms.number(NamedNode(iri)) for iri in _REFLEXIVE}
        kept: set[Triple] = set()
        for fact in {fact for fact, in_round in self.known.items() if in_round > after} - self._given - _truisms():
            subject, predicate, object = fact
            if subject == object and predicate in reflexive:
                continue
            if subject not in hidden and object not in hidden and predicate not in helpers:
                kept.update(list(terms.triples(fact))[:1])
        return kept

    def why(self, statement: Statement | Triple) -> Derivation | None:
        """Return how a statement was first inferred; None where it was given, does not follow, or needs no premise."""
        subject, predicate, object = map(self.terms.number, statement)
        return self._why((subject, predicate, object))

    def is_helper(self, statement: Statement) -> bool:
        """Whether a statement is one that the rules make for themselves, to walk along lists."""
        return self.terms.number(statement[1]) in self.helpers()

    def _why(self, conclusion: Fact) -> Derivation | None:
        if conclusion in self._given or conclusion not in self.known:
            return None
        for rule, premises in self._derivations(conclusion):
            return Derivation(rule.name, tuple(map(self._shown, premises)))
        return None

    def _derivations(self, conclusion: Fact) -> Iterator[tuple[DatalogRule, list[Fact]]]:
        """Yield the rules that draw a conclusion from what was known before it, each with its premises."""
        derived = self.known[conclusion]
        for rule, join, arguments in self._program.concluding(conclusion):
            for values in join(self.facts, self.facts, *arguments):
                premises = self._program.premises(rule, values)
                # what an ontology says of datatypes is applied, and is no fact beside it
                if all(self.known.get(premise, derived) < derived for premise in premises):
                    yield rule, premises

    def _grounds(self, facts: Iterable[Fact]) -> set[Triple]:
        """Return the given triples that facts follow from, in all ways that they do."""
        todo, seen, grounds = list(facts), set[Fact](), set[Triple]()
        while todo:
            fact = todo.pop()
            if fact in seen:
                continue
            seen.add(fact)
            if fact in self._given:
                grounds.update(self._triples.intersection(self.terms.triples(fact)))
            elif fact in self.known:
                todo += (premise for _, premises in self._derivations(fact) for premise in premises)
        return grounds

    def _saturate(self, facts: Iterable[Fact]) -> None:
        fresh = self._unknown(facts)
        while fresh:
            fresh += self._equal(fresh)
            self._rounds += 1
            for fact in fresh:
                self.facts.add(fact)
            new = Facts(fresh)
            by_rules = (fact for join in self._program.forward for fact in join(self.facts, new))
            fresh = self._unknown(chain(self._of_values(fresh), by_rules))

    def _equal(self, fresh: list[Fact]) -> list[Fact]:
        """Return what follows of new equalities by symmetry and transitivity, by joining groups of equals."""
        same, equal = self._program.same, list[Fact]()
        for first, predicate, second in fresh:
            if predicate != same or first == second:
                continue
            ones, others = (self._groups.setdefault(number, {number}) for number in (first, second))
            if ones is others:
                continue
            steps = (
                [(second, first)],
                ((member, second) for member in ones),
                product(ones, others),
                product(others, ones),
            )
            for step in steps:  # each from what the ones before it found
                self._rounds += 1
                equal += self._unknown((left, same, right) for left, right in step if left != right)
            ones |= others
            self._groups.update(dict.fromkeys(others, ones))
        return equal

    def _unknown(self, facts: Iterable[Fact]) -> list[Fact]:
        """Return those facts that are not known yet, and note the round that they are found in."""
        known, before, unknown, drawn, number_of_round = self.known, self._before, [], self._drawn, self._rounds
        most = len(self._given) + MOST_FACTS
        for drawn, fact in enumerate(facts, self._drawn):
            if fact not in known and fact not in before:
                known[fact] = number_of_round
                unknown.append(fact)
            if drawn > MOST_CONCLUSIONS or len(known) > most:
                raise InputError(
                    f"OWL 2 RL draws more than {MOST_CONCLUSIONS:,} conclusions or {MOST_FACTS:,} different ones: "
                    "look for large groups of owl:sameAs, or long chains of a transitive property"
                )
        self._drawn = drawn
        return unknown

    def _types_of_mentioned(self) -> Iterator[Fact]:
        """Say of each literal which of the datatypes that the graph speaks of contain it (dt-type2)."""
        nodes = {number for subject, _, object in self._given for number in (subject, object)}
        mentioned = {iri: number for number in nodes if datatypes.is_datatype(iri := self.iri(number))}
        if mentioned:
            for number, value in self.terms.values.items():
                for iri in datatypes.datatypes_of(value) & mentioned.keys():
                    yield (number, self._program.type, mentioned[iri])

    def _of_values(self, fresh: list[Fact]) -> Iterator[Fact]:
        """Say what is known of values that have just been given another name (dt-type2, dt-diff)."""
        values = self.terms.values
        same = [fact for fact in fresh if fact[1] == self._program.same and fact[0] != fact[2]]
        two_values = [fact for fact in same if fact[0] in values and fact[2] in values]
        if two_values:
            raise self._two_values(two_values)
        for subject, _, object in same:
            for number in {subject, object} & self.terms.values.keys() - self._named_values:
                for iri in datatypes.datatypes_of(self.terms.values[number]):
                    yield (number, self._program.type, self.terms.number(NamedNode(iri)))
                for other in self._named_values:
                    yield (number, self._program.different, other)
                    yield (other, self._program.different, number)
                self._named_values.add(number)

    def _add_reflexives(self) -> None:
        """Say of everything that it is the same as itself (eq-ref).

        Rules need not look at that, unless somebody says something about owl:sameAs itself.
        """
        same = self._program.same
        helpers = self.helpers()
        facts = [fact for fact in self.known if fact[1] not in helpers]
        reflexive = [(number, same, number) for number in {same, *(number for fact in facts for number in fact)}]
        if any(same in (fact[0], fact[2]) for fact in facts):
            self._saturate(reflexive)
        else:
            for fact in self._unknown(reflexive):
                self.facts.add(fact)

    def _refuse_ill_typed(self) -> None:
        ill_typed = set(map(self.terms.number, self.terms.ill_typed))
        for literal in self.terms.ill_typed:
            use, given = self._use(self.terms.number(literal)), (fact for fact in self._given if fact[2] in ill_typed)
            raise not_of(use, literal.datatype.value, self._grounds(given))

    def _refuse_contradictions(self) -> None:
        for rule, join in self._program.contradictions:
            bindings = list(dict.fromkeys(join(self.facts, self.facts)))
            if bindings:
                clashes = chain(*(self._program.clashes(rule, culprits, self.facts) for culprits in bindings))
                given = self._grounds(chain(*clashes))
                raise contradiction(rule.name, ", ".join(map(self._name, bindings[0])), given)
        self._refuse_other_datatypes(self.facts)

    def _refuse_other_datatypes(self, facts: Facts) -> None:
        """Refuse values that are said to be of a datatype, and are not (dt-not-type)."""
        for kind, members in facts.subjects.get(self._program.type, {}).items():
            if datatypes.is_datatype(self.iri(kind)):
                for number in members & self.terms.values.keys():
                    if self.iri(kind) not in datatypes.datatypes_of(self.terms.values[number]):
                        of_kind = (number, self._program.type, kind)
                        raise not_of(self._use(number), self.iri(kind), self._grounds([of_kind]))

    def helpers(self) -> set[Number]:
        """Return the predicates that only rules speak: their own, and lists that stand for a chain or a key."""
        lists = (self.facts.objects.get(number, {}) for number in self._program.helpers)
        return self._program.helpers.union(*lists)

    def in_words(self, fact: Fact) -> str:
        """Return a statement as people write it."""
        return " ".join(map(self._name, fact))

    def _shown(self, fact: Fact) -> Statement:
        subject, predicate, object = (self.terms.forms[number][0] for number in fact)
        return (subject, predicate, object)

    def _two_values(self, same: list[Fact]) -> Contradiction:
        """Return the error of values that are said to be the same, and differ."""
        derivation, given = self._why(same[0]), self._grounds(same)
        if derivation is None:
            return contradiction("dt-diff", " is the same as ".join(map(self._name, same[0][::2])), given)
        return contradiction(f"{derivation.rule}, dt-diff", "; ".join(map(say, derivation.premises)), given)

    def _use(self, number: Number) -> str:
        """Return a given triple, as people write it, whose object has the number."""
        return self.in_words(next(fact for fact in self._given if fact[2] == number))

    def iri(self, number: Number) -> str:
        """Return the IRI that has a number, or nothing where it is of a literal or blank node."""
        forms = self.terms.forms[number]
        return forms[0].value if forms and isinstance(forms[0], NamedNode) else ""

    def _name(self, number: Number) -> str:
        return show(self.terms.forms[number][0])


@cache
def _truisms() -> frozenset[Fact]:
    """Return what follows from nothing."""
    return frozenset(Closure([]).known)


def says_something(triple: Triple) -> bool:
    """Whether a conclusion is worth keeping in a graph, as `Closure.worth_keeping` has it."""
    if triple.subject == triple.object and triple.predicate.value in _REFLEXIVE:
        return False
    return not is_hidden(triple.subject) and not is_hidden(triple.object)


def show(term: Node, base: str = ID) -> str:
    """Return a term as people write it, with prefixes; individuals lie below a base."""
    if isinstance(term, NamedNode):
        return shorten(term.value, base)
    if isinstance(term, Literal) and term.datatype.value != XSD + "string" and term.language is None:
        return f'"{term.value}"^^{shorten(term.datatype.value)}'
    return str(term)


def say(statement: Iterable[Node], base: str = ID) -> str:
    """Return a triple, or some of its terms, as people write it."""
    return " ".join(show(term, base) for term in statement)


def contradiction(rule: str, terms: str, given: Iterable[Triple] = ()) -> Contradiction:
    """Return the error of a rule that finds a contradiction, and the terms it finds it of."""
    return Contradiction(f"statements contradict each other (OWL 2 RL rule {rule}): {terms}", given)


def not_of(use: str, datatype: str, given: Iterable[Triple] = ()) -> Contradiction:
    """Return the error of a value, in a statement that uses it, that is not of a datatype."""
    return contradiction("dt-not-type", f"the value is not of {shorten(datatype)} in {use}", given)
