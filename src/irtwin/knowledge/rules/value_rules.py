"""Classes that an individual defines, as SWRL rules: what tableau reasoners conclude from them is the same, and soon.

A restriction to an individual (`owl:hasValue`) makes HermiT carry every individual of a graph through each of its tests
of a class or property: the demo's graph did not end in 400 s. A rule speaks of named individuals alone, as our graph
does, and costs it nothing.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import product

from pyoxigraph import BlankNode, NamedNode, Triple

from irtwin.knowledge.rules.as_swrl import VARIABLE, class_atom, imp, link_atom, triples_of
from irtwin.knowledge.store.by_subject import BySubject, Node
from irtwin.knowledge.vocabulary import OWL, RDFS, TYPE, shorten

_BELOW, _SAME = NamedNode(RDFS + "subClassOf"), NamedNode(OWL + "equivalentClass")
_THIS = f"<{VARIABLE}this>"

Atom = tuple[NamedNode, NamedNode]  # a property and its value; rdf:type and a class


class _NoRule(Exception):
    """A class expression that is more than named classes and values."""


def values_as_rules(triples: Iterable[Triple]) -> set[Triple]:
    """Return triples in which each axiom of a class and an individual is a rule, or two where they are equivalent.

    What an alternative of values ("wear or play") would say of a member, that it has one of them, no rule says. An
    axiom of other expressions besides stays as it is.
    """
    kept = set(triples)
    statements = BySubject(kept, OWL)
    for axiom in [triple for triple in kept if triple.predicate in (_BELOW, _SAME)]:
        if isinstance(axiom.subject, NamedNode) and _individuals(statements, axiom.object):
            try:
                rules = _rules(statements, axiom.subject, axiom)
            except _NoRule:
                continue
            kept -= {axiom, *_expression(statements, axiom.object)}
            kept |= rules
    return kept


def _individuals(statements: BySubject, expression: Node) -> bool:
    """Whether a class expression has an individual for a value, however deep."""
    if not isinstance(expression, BlankNode):
        return False
    return isinstance(statements.value(expression, "hasValue"), NamedNode) or any(
        _individuals(statements, part) for part in _parts(statements, expression)
    )


def _parts(statements: BySubject, expression: Node) -> list[Node]:
    return [
        part for name in ("intersectionOf", "unionOf") for part in statements.items(statements.value(expression, name))
    ]


def _rules(statements: BySubject, of_class: NamedNode, axiom: Triple) -> set[Triple]:
    is_class = (TYPE, of_class)
    label = f"definition of {statements.text(of_class, RDFS + 'label') or shorten(of_class.value)}"
    made = set[Triple]()
    alternatives = _alternatives(statements, axiom.object)
    if len(alternatives) == 1:
        for predicate, value in alternatives[0]:
            if predicate != TYPE:
                made.update(_imp(label, [is_class], (predicate, value)))
            elif value != of_class:
                made.add(Triple(of_class, _BELOW, value))
    if axiom.predicate == _SAME:
        for atoms in alternatives:
            made.update(_imp(label, atoms, is_class))
    return made


def _alternatives(statements: BySubject, expression: Node) -> list[list[Atom]]:
    """Return what a class expression asks of a member: the atoms of one of the lists."""
    if isinstance(expression, NamedNode):
        return [[(TYPE, expression)]]
    of_property, value = statements.value(expression, "onProperty"), statements.value(expression, "hasValue")
    if isinstance(of_property, NamedNode) and isinstance(value, NamedNode):
        return [[(of_property, value)]]
    if one_of := statements.items(statements.value(expression, "unionOf")):
        return [atoms for part in one_of for atoms in _alternatives(statements, part)]
    if all_of := statements.items(statements.value(expression, "intersectionOf")):
        chosen = product(*(_alternatives(statements, part) for part in all_of))
        return [[atom for atoms in choice for atom in atoms] for choice in chosen]
    raise _NoRule


def _expression(statements: BySubject, expression: Node) -> Iterator[Triple]:
    """Yield the triples that write a class expression, its lists among them."""
    if isinstance(expression, BlankNode):
        for name, values in statements.said_of(expression):
            for value in values:
                yield Triple(expression, NamedNode(name), value)
                yield from _expression(statements, value)


def _imp(label: str, body: list[Atom], head: Atom) -> set[Triple]:
    return triples_of(imp(label, ("this",), [_atom(*atom) for atom in body], _atom(*head)))


def _atom(predicate: NamedNode, value: NamedNode) -> str:
    return class_atom(_THIS, str(value)) if predicate == TYPE else link_atom(_THIS, str(predicate), str(value))
