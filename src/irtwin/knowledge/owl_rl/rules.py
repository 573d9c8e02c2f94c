"""Rules as the files in `rules/*.rq` write them, and the loops that they become.

A rule is a SPARQL query whose body is triple patterns and inequalities and nothing else: that is Datalog, which can be
run forward over what is new (semi-naive evaluation) and asked backward for what a conclusion follows from.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Container, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

Number = int
Fact = tuple[Number, Number, Number]  # subject, predicate, object
Term = str  # as SPARQL writes it: ?x, owl:sameAs, a
Pattern = tuple[Term, Term, Term]
Join = Callable[..., Iterator[Any]]  # of facts, or of tuples of numbers

_RULE = re.compile(
    r"^## (\S+)\n(CONSTRUCT \{ (.+?) \}|SELECT (.+?)) WHERE \{ (.+?)(?: FILTER\((.+)\))? \}$", re.MULTILINE
)


@dataclass(frozen=True)
class DatalogRule:
    """A rule by its name. One that `head` is empty for finds a contradiction, shown by `culprits`."""

    name: str
    head: tuple[Pattern, ...]
    culprits: tuple[Term, ...]
    body: tuple[Pattern, ...]
    unequal: tuple[tuple[Term, Term], ...]

    @cached_property
    def variables(self) -> tuple[Term, ...]:
        """The variables of the body."""
        return tuple(dict.fromkeys(term for pattern in self.body for term in pattern if term.startswith("?")))


def read_rules(file: Path) -> tuple[DatalogRule, ...]:
    """Return the rules of a file, in its order."""
    return tuple(_rule(match) for match in _RULE.finditer(file.read_text(encoding="utf-8")))


def _rule(match: re.Match[str]) -> DatalogRule:
    name, _, head, culprits, body, condition = match.groups()
    pairs = (part.split(" != ") for part in (condition or "").split(" && ") if part)
    return DatalogRule(
        name=name,
        head=_patterns(head or ""),
        culprits=tuple((culprits or "").split()),
        body=_patterns(body),
        unequal=tuple((first, second) for first, second in pairs),
    )


def _patterns(text: str) -> tuple[Pattern, ...]:
    parts = (part.split() for part in text.split(" . ") if part)
    return tuple((subject, "rdf:type" if verb == "a" else verb, object) for subject, verb, object in parts)


class Facts:
    """Triples of numbers, found by predicate and subject, or by predicate and object."""

    def __init__(self, facts: Sequence[Fact] = ()):
        self.objects: dict[Number, dict[Number, set[Number]]] = {}
        self.subjects: dict[Number, dict[Number, set[Number]]] = {}
        for fact in facts:
            self.add(fact)

    def __iter__(self) -> Iterator[Fact]:
        for predicate, objects in self.objects.items():
            for subject, values in objects.items():
                for object in values:
                    yield (subject, predicate, object)

    def add(self, fact: Fact) -> None:
        """Add a triple."""
        subject, predicate, object = fact
        self.objects.setdefault(predicate, {}).setdefault(subject, set()).add(object)
        self.subjects.setdefault(predicate, {}).setdefault(object, set()).add(subject)

    def copy(self, changing: Container[Number | None]) -> Facts:
        """Return the same triples, to be added to apart with some predicates alone; with any where None is one."""
        other = Facts()
        for mine, its in ((self.objects, other.objects), (self.subjects, other.subjects)):
            for predicate, values in mine.items():
                changes = None in changing or predicate in changing
                its[predicate] = {key: set(some) for key, some in values.items()} if changes else values
        return other


def compile_join(
    rule: DatalogRule,
    number_of: Callable[[Term], Number],
    results: Sequence[Sequence[Term]],
    *,
    new: int | None = None,
    given: Sequence[Term] = (),
) -> Join:
    """Return the rule's body as a function of all facts and the new ones.

    For each match of the body it yields the values of each of `results`. Pattern number `new` is looked for among
    the new facts alone; values of the `given` variables are arguments after the facts.
    """
    writer = _Writer(rule, number_of, new, given)
    source = writer.write(results)
    scope: dict[str, Any] = {"EMPTY": {}}
    exec(compile(source, f"<{rule.name}>", "exec"), scope)  # the source is made of the project's own rule files alone
    join: Join = scope["join"]
    return join


class _Writer:
    """Writes a rule's body as nested loops, the pattern with the fewest open variables next."""

    def __init__(self, rule: DatalogRule, number_of: Callable[[Term], Number], new: int | None, given: Sequence[Term]):
        self._rule = rule
        self._number_of = number_of
        self._new = new
        self._given = given
        self._bound = set(given)
        self._left = dict(enumerate(rule.body))
        self._unequal = list(rule.unequal)
        self._lines: list[str] = []
        self._depth = 1

    def write(self, results: Sequence[Sequence[Term]]) -> str:
        arguments = ", ".join(["known", "new", *map(self._name, self._given)])
        self._put("known_objects, known_subjects = known.objects, known.subjects")
        self._put("new_objects, new_subjects = new.objects, new.subjects")
        self._bind(*self._given)
        if self._new is not None:
            self._start(self._new)
        while self._left:
            self._loop(min(self._left, key=self._cost))
        for result in results:
            self._put(f"yield ({', '.join(map(self._name, result))},)")
        return "\n".join([f"def join({arguments}):", *self._lines])

    def _start(self, index: int) -> None:
        """Begin with the new facts; with their predicates alone where these are open, for others to narrow down."""
        predicate = self._rule.body[index][1]
        if self._is_open(predicate):
            self._loop_over_predicates(predicate, "new")
        else:
            self._loop(index)

    def _cost(self, index: int) -> tuple[int, bool, bool, int]:
        subject, predicate, object = self._left[index]
        open_ends = sum(self._is_open(term) for term in {subject, object})
        by_constant = self._bound.isdisjoint((subject, object))  # which fits more facts than a variable's value does
        return (open_ends + 3 * self._is_open(predicate), by_constant, index != self._new, index)

    def _loop(self, index: int) -> None:
        subject, predicate, object = self._left.pop(index)
        facts = "new" if index == self._new else "known"
        if self._is_open(predicate):
            self._loop_over_predicates(predicate, facts)
        s, p, o = map(self._name, (subject, predicate, object))
        by_subject, by_object = f"{facts}_objects.get({p}, EMPTY)", f"{facts}_subjects.get({p}, EMPTY)"
        if not self._is_open(subject):
            self._put(f"{'for' if self._is_open(object) else 'if'} {o} in {by_subject}.get({s}, ()):", deeper=True)
        elif not self._is_open(object):
            self._put(f"for {s} in {by_object}.get({o}, ()):", deeper=True)
        else:
            self._put(f"for {s}, found in {by_subject}.items():", deeper=True)
            self._put(f"{'if' if s == o else 'for'} {o} in found:", deeper=True)
        self._bind(subject, object)

    def _loop_over_predicates(self, predicate: Term, facts: str) -> None:
        self._put(f"for {self._name(predicate)} in {facts}_objects:", deeper=True)
        self._bind(predicate)

    def _bind(self, *terms: Term) -> None:
        self._bound.update(term for term in terms if term.startswith("?"))
        ready = [pair for pair in self._unequal if not any(map(self._is_open, pair))]
        for left, right in ready:
            self._put(f"if {self._name(left)} != {self._name(right)}:", deeper=True)
            self._unequal.remove((left, right))

    def _put(self, line: str, *, deeper: bool = False) -> None:
        self._lines.append("    " * self._depth + line)
        self._depth += deeper

    def _is_open(self, term: Term) -> bool:
        return term.startswith("?") and term not in self._bound

    def _name(self, term: Term) -> str:
        return term[1:] + "_" if term.startswith("?") else str(self._number_of(term))
