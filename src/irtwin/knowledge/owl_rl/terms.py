"""RDF terms as numbers, for rules to run over. Literals of the same value have the same number."""

from __future__ import annotations

from collections.abc import Hashable, Iterable
from typing import Self

from pyoxigraph import BlankNode, Literal, NamedNode, Triple

from irtwin.knowledge.owl_rl import datatypes
from irtwin.knowledge.owl_rl.datatypes import IllTyped, Value
from irtwin.knowledge.owl_rl.rules import Fact, Number
from irtwin.knowledge.vocabulary import OWL

Node = NamedNode | BlankNode | Literal | Triple
_TRIVIAL = (OWL + "Thing", OWL + "Nothing")


class Terms:
    """A table of terms and their numbers.

    `forms[number]` are the terms that have the number: several literals where one value is written in several ways.
    `values[number]` is the value, for literals of known datatypes alone; `ill_typed` are literals that have none.
    `hidden` are those of terms that nothing is worth keeping of.
    """

    def __init__(self) -> None:
        self.forms: list[list[Node]] = []
        self.values: dict[Number, Value] = {}
        self.literals: set[Number] = set()
        self.hidden: set[Number] = set()
        self.ill_typed: list[Literal] = []
        self._numbers: dict[Hashable, Number] = {}

    def copy(self) -> Self:
        """Return a table that begins with the same numbers."""
        other = type(self)()
        other.forms = [list(forms) for forms in self.forms]
        other.values, other.literals, other.hidden = dict(self.values), set(self.literals), set(self.hidden)
        other.ill_typed, other._numbers = list(self.ill_typed), dict(self._numbers)
        return other

    def number(self, term: Node) -> Number:
        """Return the term's number, a new one where it has none yet."""
        number = self._numbers.get(term)
        if number is None:
            number = self._numbers[term] = self._literal(term) if isinstance(term, Literal) else self._add(term)
        return number

    def reserve(self, name: NamedNode, value: Value | None) -> None:
        """Give a number to a value that nobody has written yet, and a name for rules to call it by."""
        number = self._numbers[name] = self._numbers[value] = len(self.forms)
        self.forms.append([])
        self.literals.add(number)
        if value is not None:
            self.values[number] = value

    def facts(self, triples: Iterable[Triple]) -> list[Fact]:
        """Return triples as numbers."""
        known, number, facts = self._numbers.get, self.number, []
        for subject, predicate, object in triples:
            s, p, o = known(subject), known(predicate), known(object)
            if s is None or p is None or o is None:
                s, p, o = number(subject), number(predicate), number(object)
            facts.append((s, p, o))
        return facts

    def triples(self, fact: Fact) -> Iterable[Triple]:
        """Return what numbers stand for: no triple where RDF has none, one for each way to write a literal."""
        if fact[0] in self.literals or fact[1] in self.literals:
            return ()
        subject, predicate = self.forms[fact[0]][0], self.forms[fact[1]][0]
        if isinstance(subject, Literal) or not isinstance(predicate, NamedNode):
            return ()
        return [Triple(subject, predicate, object) for object in self.forms[fact[2]]]

    def _add(self, term: Node) -> Number:
        self.forms.append([term])
        if is_hidden(term):
            self.hidden.add(len(self.forms) - 1)
        return len(self.forms) - 1

    def _literal(self, literal: Literal) -> Number:
        try:
            value = datatypes.value(literal.value, literal.datatype.value, literal.language)
        except IllTyped:
            self.ill_typed.append(literal)
            value = None
        known = None if value is None else self._numbers.get(value)
        if known is not None:
            self.forms[known].append(literal)
            return known
        number = self._add(literal)
        self.literals.add(number)
        if value is not None:
            self._numbers[value] = number
            self.values[number] = value
        return number


def is_hidden(term: Node) -> bool:
    """Whether what is said of a term is not worth keeping: of everything, of anonymous classes, of datatypes."""
    if isinstance(term, NamedNode):
        return term.value in _TRIVIAL or datatypes.is_datatype(term.value)
    return isinstance(term, BlankNode)
