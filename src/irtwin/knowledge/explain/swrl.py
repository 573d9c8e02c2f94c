"""SWRL rules as queries, so that what one concluded can be followed to its premises as what a SHACL rule did is."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from decimal import Decimal
from functools import cache
from typing import Any

from pyoxigraph import Literal, NamedNode, Triple

from irtwin.knowledge.shacl.rules import ShaclRule
from irtwin.knowledge.store.graph import read_turtle
from irtwin.knowledge.vocabulary import RDF, RDFS
from irtwin.resources import Files

_SWRL = "http://www.w3.org/2003/11/swrl#"
_SWRLB = "http://www.w3.org/2003/11/swrlb#"
_NIL = NamedNode(RDF + "nil")
_COMPARED = {
    "equal": "=", "notEqual": "!=", "lessThan": "<", "lessThanOrEqual": "<=", "greaterThan": ">",
    "greaterThanOrEqual": ">=",
}  # fmt: skip
_RECKONED = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/"}  # the first argument is the result

Said = dict[Any, dict[str, Any]]


@cache
def swrl_rules(files: Files) -> tuple[ShaclRule, ...]:
    """Return the rules of files `rules/*.swrl.ttl`, each as a CONSTRUCT."""
    return tuple(rule for file in files for rule in rules_of(read_turtle(file.path)))


def rules_of(triples: Iterable[Triple]) -> Iterator[ShaclRule]:
    """Yield the SWRL rules among triples, each as a CONSTRUCT; a built-in that SPARQL lacks is left out of it."""
    said: Said = {}
    for triple in triples:
        said.setdefault(triple.subject, {})[triple.predicate.value] = triple.object
    for rule in said.values():
        if _SWRL + "body" in rule:
            body = [_atom(said, said[atom]) for atom in _items(said, rule[_SWRL + "body"])]
            head = [_atom(said, said[atom]) for atom in _items(said, rule[_SWRL + "head"])]
            where = "\n".join(sorted(body, key=_turn))
            label, comment = (getattr(rule.get(RDFS + name), "value", "") for name in ("label", "comment"))
            yield ShaclRule(
                name=label,
                label=label,
                comment=comment,
                order=(Decimal(0), Decimal(0)),
                construct=f"CONSTRUCT {{ {' '.join(head)} }} WHERE {{ {where} }}",
            )


def _turn(line: str) -> int:
    """Triples first, then what is reckoned from them, then what is compared."""
    return ("BIND" in line) + 2 * ("FILTER" in line)


def _atom(said: Said, atom: dict[str, Any]) -> str:
    if _SWRL + "builtin" in atom:
        return _built_in(atom, [_term(each) for each in _items(said, atom.get(_SWRL + "arguments"))])
    subject = _term(atom[_SWRL + "argument1"])
    if _SWRL + "classPredicate" in atom:
        return f"{subject} <{RDF}type> {atom[_SWRL + 'classPredicate']} ."
    return f"{subject} {atom[_SWRL + 'propertyPredicate']} {_term(atom[_SWRL + 'argument2'])} ."


def _built_in(atom: dict[str, Any], arguments: list[str]) -> str:
    name = atom[_SWRL + "builtin"].value.removeprefix(_SWRLB)
    if name in _COMPARED and len(arguments) == 2:
        return f"FILTER({arguments[0]} {_COMPARED[name]} {arguments[1]})"
    if name in _RECKONED and len(arguments) > 2:
        return f"BIND({f' {_RECKONED[name]} '.join(arguments[1:])} AS {arguments[0]})"
    return ""


def _items(said: Said, cell: Any) -> Iterator[Any]:
    while cell is not None and cell != _NIL:
        yield said[cell][RDF + "first"]
        cell = said[cell][RDF + "rest"]


def _term(term: Any) -> str:
    """Return a term as SPARQL writes it: a named variable of SWRL's is an IRI."""
    if isinstance(term, Literal):
        return str(term)
    return f"?{term.value.rpartition('#')[2]}" if "/variable#" in term.value else str(term)
