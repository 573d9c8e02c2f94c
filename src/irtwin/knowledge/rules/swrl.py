"""SWRL rules: each becomes one CONSTRUCT, so that it is run and explained as those of SHACL are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from decimal import Decimal
from typing import Any

from pyoxigraph import BlankNode, Literal, NamedNode, Triple

from irtwin.errors import InputError
from irtwin.knowledge.rules.rule import SWRL, Rule
from irtwin.knowledge.store.by_subject import BySubject, Node
from irtwin.knowledge.vocabulary import OWL, RDF, RDFS, XSD, shorten

NAMESPACE = "http://www.w3.org/2003/11/swrl#"
BUILT_INS = "http://www.w3.org/2003/11/swrlb#"

FACETS = {"minExclusive": ">", "minInclusive": ">=", "maxExclusive": "<", "maxInclusive": "<="}  # of XSD

_COMPARED = {
    "equal": "=", "notEqual": "!=", "lessThan": "<", "lessThanOrEqual": "<=", "greaterThan": ">",
    "greaterThanOrEqual": ">=",
}  # fmt: skip
_RECKONED = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}  # the first argument is the result
_SAME = {"SameIndividualAtom": "=", "DifferentIndividualsAtom": "!="}


def rules_of(triples: Iterable[Triple], source: str) -> Iterator[Rule]:
    """Yield the SWRL rules among triples; `source` names them in messages. InputError for one that is not understood.

    Class atoms name a class, or a restriction to values; built-ins compare, add, subtract, multiply or divide.
    """
    statements = BySubject(triples, NAMESPACE)
    for node in statements.having(RDF + "type", NAMESPACE + "Imp"):
        label, comment = statements.text(node, RDFS + "label"), statements.text(node, RDFS + "comment")
        if not label:
            raise InputError(f"{source}: a swrl:Imp has no rdfs:label; give it one, for messages to name it")
        construct = _Imp(statements, f"{source}: the rule {label!r}").construct(node)
        name = node.value if isinstance(node, NamedNode) else label
        yield Rule(name, label, comment, (Decimal(0), Decimal(0)), construct, SWRL)


class _Imp:
    """One rule in the making: the triples of its file, and what its variables are called."""

    def __init__(self, statements: BySubject, where: str):
        self._said, self._where = statements, where
        self._names: dict[str, str] = {}

    def construct(self, rule: Node) -> str:
        body, head = (self._atoms(rule, part) for part in ("body", "head"))
        self._name_focus(body)
        where = [line for atom in body for line in self._lines(atom)]
        made = [line for atom in head for line in self._lines(atom)]
        if any(line.startswith(("BIND", "FILTER")) for line in made):
            raise self._fault("concludes more than classes and properties; do that in its swrl:body")
        return f"CONSTRUCT {{ {' '.join(made)} }} WHERE {{ {' '.join(sorted(where, key=_turn))} }}"

    def _atoms(self, rule: Node, part: str) -> list[Node]:
        atoms = self._said.items(self._said.value(rule, part))
        if not atoms or not all(map(self._said.said_of, atoms)):
            raise self._fault(f"has no list of atoms for its swrl:{part}")
        return atoms

    def _name_focus(self, body: list[Node]) -> None:
        """Call the individual that the rule begins with `$this`, as SHACL does."""
        firsts = (self._said.value(atom, "argument1") for atom in body)
        focus = next((argument for argument in firsts if self._is_variable(argument)), None)
        if isinstance(focus, NamedNode | BlankNode):
            self._names[focus.value] = "this"

    def _lines(self, atom: Node) -> list[str]:
        kind = getattr(self._said.value(atom, RDF + "type"), "value", "").removeprefix(NAMESPACE)
        first, second = (self._said.value(atom, name) for name in ("argument1", "argument2"))
        if kind == "BuiltinAtom":
            return [self._built_in(atom)]
        if kind == "ClassAtom" and first is not None:
            return self._class(self._term(first), self._said.value(atom, "classPredicate"))
        if kind == "DataRangeAtom" and first is not None:
            return self._range(self._term(first), self._said.value(atom, "dataRange"))
        if first is None or second is None:
            raise self._fault(f"has a swrl:{kind or 'Atom'} that lacks an argument, or is none of SWRL's")
        if kind in _SAME:
            return [f"FILTER({self._term(first)} {_SAME[kind]} {self._term(second)})"]
        return [f"{self._term(first)} {self._said.value(atom, 'propertyPredicate')} {self._term(second)} ."]

    def _class(self, subject: str, kind: Any) -> list[str]:
        """Return an atom of a class, or of a restriction to some value."""
        if isinstance(kind, NamedNode):
            return [f"{subject} <{RDF}type> {kind} ."]
        names = ("onProperty", "hasValue", "someValuesFrom")
        of_property, value, some = (self._said.value(kind, OWL + name) for name in names)
        if isinstance(of_property, NamedNode) and value is not None:
            return [f"{subject} {of_property} {self._term(value)} ."]
        if isinstance(of_property, NamedNode) and some is not None:
            variable = f"?value{len(self._names)}"
            self._names[variable] = variable[1:]
            within = [] if some == NamedNode(RDFS + "Literal") else self._range(variable, some)
            return [f"{subject} {of_property} {variable} .", *within]
        raise self._fault("has a class expression that irtwin does not run; name a class for it in ontology/")

    def _range(self, value: str, kind: Any) -> list[str]:
        if isinstance(kind, NamedNode):
            return [f"FILTER(DATATYPE({value}) = {kind})"]
        facets = [
            (name.removeprefix(XSD), limit)
            for facet in self._said.items(self._said.value(kind, OWL + "withRestrictions"))
            for name, (limit, *_) in self._said.said_of(facet)
        ]
        if not facets or any(name not in FACETS for name, _ in facets):
            raise self._fault(f"has a data range that is none of {', '.join(FACETS)}; write it as a built-in")
        return [f"FILTER({value} {FACETS[name]} {self._term(limit)})" for name, limit in facets]

    def _built_in(self, atom: Node) -> str:
        iri = getattr(self._said.value(atom, "builtin"), "value", "")
        name = iri.removeprefix(BUILT_INS)
        arguments = [self._term(argument) for argument in self._said.items(self._said.value(atom, "arguments"))]
        if name in _COMPARED and len(arguments) == 2:
            return f"FILTER({arguments[0]} {_COMPARED[name]} {arguments[1]})"
        if name in _RECKONED and len(arguments) > 2:
            return f"BIND({f' {_RECKONED[name]} '.join(arguments[1:])} AS {arguments[0]})"
        if iri.startswith(BUILT_INS):
            known = ", ".join([*_COMPARED, *_RECKONED])
            raise self._fault(f"uses swrlb:{name} as irtwin does not run it: it runs {known}; write the rule in SHACL")
        raise self._fault(f"uses {shorten(iri)}, which is no built-in of SWRL")

    def _term(self, term: Any) -> str:
        if not self._is_variable(term):
            return str(term)
        if term.value not in self._names:
            name = re.sub(r"\W", "_", re.split("[/#]", term.value)[-1])
            taken = name in self._names.values()
            self._names[term.value] = f"{name}{len(self._names)}" if taken else name
        return f"?{self._names[term.value]}"

    def _is_variable(self, term: Any) -> bool:
        if isinstance(term, Literal) or term is None:
            return False
        return self._said.value(term, RDF + "type") == NamedNode(NAMESPACE + "Variable")

    def _fault(self, problem: str) -> InputError:
        return InputError(f"{self._where} {problem}")


def _turn(line: str) -> int:
    """Triples first, then what is reckoned from them, then what is compared."""
    return line.startswith("BIND") + 2 * line.startswith("FILTER")
