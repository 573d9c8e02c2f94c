"""SHACL rules, each run once over all its focus nodes instead of once for each of them.

A rule becomes one CONSTRUCT whose `$this` is tied to the shape's targets. The result is what
a SHACL engine gives that iterates its rules, in milliseconds where that takes minutes.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass
from decimal import Decimal, InvalidOperation
from functools import lru_cache
from itertools import groupby
from pathlib import Path
from typing import cast
from urllib.parse import quote

from pyoxigraph import BlankNode, Literal, NamedNode, QueryTriples, Store, Triple

from irtwin.errors import InputError
from irtwin.knowledge.shacl.shapes import Node, Shapes
from irtwin.knowledge.store.graph import KnowledgeGraph, in_graph, read_turtle
from irtwin.knowledge.store.sparql_text import masked
from irtwin.knowledge.vocabulary import GRAPH_SHACL, OWL, PREFIXES, RDF, RDFS, SH, shorten
from irtwin.resources import Files, Resources

MOST_ROUNDS = 100

_BODY = re.compile(r"\bCONSTRUCT\s*\{[^}]*\}\s*(?:WHERE\s*)?\{", re.IGNORECASE)
_TARGETS = {
    "targetClass": "{{ $this rdf:type/rdfs:subClassOf* {} }}",
    "targetNode": "{{ VALUES $this {{ {} }} }}",
    "targetSubjectsOf": "{{ $this {} ?_any }}",
    "targetObjectsOf": "{{ ?_any {} $this }}",
}


@dataclass(frozen=True)
class ShaclRule:
    """A rule for all focus nodes: the IRI it is known by, what people call it, when its turn is, and its CONSTRUCT."""

    name: str
    label: str
    comment: str
    order: tuple[Decimal, Decimal]
    construct: str


def infer(graph: KnowledgeGraph) -> int:
    """Make the rules of the files `rules/*rules.ttl` anew from the graph; return how many triples they conclude.

    What each rule concludes is a named graph of its own.
    """
    graph.replace([], GRAPH_SHACL)
    made = conclusions(graph.triples(), all_rules(graph.resources))
    graph.replace((quad for name, found in made.items() for quad in in_graph(found, graph_of(name))), GRAPH_SHACL)
    return len(set().union(*made.values()))


def graph_of(rule: str) -> str:
    """Return the IRI of the named graph that holds what a rule concludes."""
    return f"{GRAPH_SHACL}/{quote(re.split('[/#]', rule)[-1], safe='')}"


def group_of(construct: str) -> tuple[str, str]:
    """Return the prologue of a rule's CONSTRUCT, and what stands within its WHERE { }."""
    body = _BODY.search(masked(construct))
    assert body is not None
    return construct[: body.start()], construct[body.end() : masked(construct).rindex("}")]


def conclusions(triples: Iterable[Triple], rules: Iterable[ShaclRule]) -> dict[str, set[Triple]]:
    """Run rules until nothing is new; return what each concludes, by its name, be it known already or not.

    Rules see what those with a lower sh:order have made. InputError where they never end.
    """
    store = Store()
    store.extend(in_graph(triples))
    turns = [tuple(turn) for _, turn in groupby(sorted(rules, key=_order), key=_order)]
    made: dict[str, set[Triple]] = {}
    for _ in range(MOST_ROUNDS):
        before = len(store)
        for turn in turns:
            found = [(rule.name, _construct(store, rule)) for rule in turn]
            for name, some in found:
                made.setdefault(name, set()).update(some)
                store.extend(in_graph(some))
        if len(store) == before:
            return made
    raise InputError(
        f"the SHACL rules still find something new after {MOST_ROUNDS} rounds; check whether they create blank nodes"
    )


def all_rules(resources: Resources) -> tuple[ShaclRule, ...]:
    """Return the rules of the files `rules/*rules.ttl`."""
    return _rules(resources.of("rules", "rules.ttl"))


@lru_cache(maxsize=16)
def _rules(files: Files) -> tuple[ShaclRule, ...]:
    return tuple(rule for file in files for rule in read_rules(file.path))


def read_rules(file: Path) -> tuple[ShaclRule, ...]:
    """Return the rules of a file that are not switched off; InputError for one that cannot be understood."""
    return rules_of(Shapes(read_turtle(file), str(file)))


def rules_of(shapes: Shapes) -> tuple[ShaclRule, ...]:
    """Return the rules of a shapes graph, like `read_rules`."""
    return tuple(
        _rule(shapes, shape, rule)
        for shape in shapes.having(SH + "rule")
        if not shapes.is_deactivated(shape)
        for rule in shapes.values(shape, "rule")
        if not shapes.is_deactivated(rule)
    )


def _rule(shapes: Shapes, shape: Node, rule: Node) -> ShaclRule:
    named = rule if isinstance(rule, NamedNode) else shape
    name = named.value if isinstance(named, NamedNode | BlankNode) else str(named)
    focus = " UNION ".join(_targets(shapes, shape))
    constructs = shapes.values(rule, "construct")
    if len(constructs) != 1 or not isinstance(constructs[0], Literal) or shapes.values(rule, "condition"):
        raise shapes.fault(
            shape, "a rule is a sh:SPARQLRule with one sh:construct and no sh:condition: write that in SPARQL"
        )
    construct = _set_wise(shapes, rule, constructs[0].value, focus)
    return ShaclRule(
        name=name,
        label=_text(shapes, named, "label") or shorten(name),
        comment=_text(shapes, named, "comment"),
        order=(_number(shapes, shape), _number(shapes, rule)),
        construct=construct,
    )


def _targets(shapes: Shapes, shape: Node) -> list[str]:
    found = [form.format(value) for name, form in _TARGETS.items() for value in shapes.values(shape, name)]
    if {NamedNode(RDFS + "Class"), NamedNode(OWL + "Class")} & set(shapes.values(shape, RDF + "type")):
        found.append(_TARGETS["targetClass"].format(shape))
    if not found or shapes.values(shape, "target"):
        raise shapes.fault(
            shape, "its rule needs sh:targetClass, sh:targetNode, sh:targetSubjectsOf or sh:targetObjectsOf"
        )
    return found


def _set_wise(shapes: Shapes, rule: Node, construct: str, focus: str) -> str:
    body = _BODY.search(masked(construct))
    if body is None:
        raise shapes.fault(rule, "its sh:construct is no CONSTRUCT { ... } WHERE { ... }")
    prefixes = "".join(
        f"PREFIX {_value(shapes, it, 'prefix')}: <{_value(shapes, it, 'namespace')}>\n"
        for ontology in shapes.values(rule, "prefixes")
        for it in shapes.values(ontology, "declare")
    )
    return f"{prefixes}{construct[: body.end()]} {focus} {construct[body.end() :]}"


def _construct(store: Store, rule: ShaclRule) -> set[Triple]:
    try:
        return set(cast(QueryTriples, store.query(rule.construct, prefixes=PREFIXES)))
    except SyntaxError as error:
        raise InputError(f"the SHACL rule {rule.label!r} is not SPARQL: {error}") from error


def _order(rule: ShaclRule) -> tuple[Decimal, Decimal]:
    return rule.order


def _number(shapes: Shapes, node: Node) -> Decimal:
    order = shapes.value(node, "order")
    try:
        return Decimal(order.value) if isinstance(order, Literal) else Decimal(0)
    except InvalidOperation as error:
        raise shapes.fault(node, f"sh:order {order} is no number") from error


def _text(shapes: Shapes, node: Node, name: str) -> str:
    found = shapes.value(node, RDFS + name)
    return found.value if isinstance(found, Literal) else ""


def _value(shapes: Shapes, node: Node, name: str) -> str:
    found = shapes.value(node, name)
    return found.value if isinstance(found, NamedNode | Literal) else ""
