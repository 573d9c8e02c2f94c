"""SHACL rules: each becomes one CONSTRUCT whose `$this` is tied to the shape's targets."""

from __future__ import annotations

from decimal import Decimal, InvalidOperation

from pyoxigraph import BlankNode, Literal, NamedNode

from irtwin.knowledge.rules.rule import SHACL, Rule, head_of
from irtwin.knowledge.shacl.shapes import TARGETS, Shapes
from irtwin.knowledge.store.by_subject import Node
from irtwin.knowledge.vocabulary import RDFS, SH, shorten


def rules_of(shapes: Shapes) -> tuple[Rule, ...]:
    """Return the rules of a shapes graph that are not switched off; InputError for one that cannot be understood."""
    return tuple(
        _rule(shapes, shape, rule)
        for shape in shapes.having(SH + "rule")
        if not shapes.is_deactivated(shape)
        for rule in shapes.values(shape, "rule")
        if not shapes.is_deactivated(rule)
    )


def _rule(shapes: Shapes, shape: Node, rule: Node) -> Rule:
    named = rule if isinstance(rule, NamedNode) else shape
    name = named.value if isinstance(named, NamedNode | BlankNode) else str(named)
    focus = " UNION ".join(_targets(shapes, shape))
    constructs = shapes.values(rule, "construct")
    if len(constructs) != 1 or not isinstance(constructs[0], Literal) or shapes.values(rule, "condition"):
        raise shapes.fault(
            shape, "a rule is a sh:SPARQLRule with one sh:construct and no sh:condition: write that in SPARQL"
        )
    construct = _set_wise(shapes, rule, constructs[0].value, focus)
    return Rule(
        name=name,
        label=shapes.text(named, RDFS + "label") or shorten(name),
        comment=shapes.text(named, RDFS + "comment"),
        order=(_number(shapes, shape), _number(shapes, rule)),
        construct=construct,
        language=SHACL,
    )


def _targets(shapes: Shapes, shape: Node) -> list[str]:
    targets = [f"{{ {TARGETS[name].format(value)} }}" for name, value in shapes.targets(shape)]
    if not targets or shapes.values(shape, "target"):
        raise shapes.fault(
            shape, "its rule needs sh:targetClass, sh:targetNode, sh:targetSubjectsOf or sh:targetObjectsOf"
        )
    return targets


def _set_wise(shapes: Shapes, rule: Node, construct: str, focus: str) -> str:
    head = head_of(construct)
    if head is None:
        raise shapes.fault(rule, "its sh:construct is no CONSTRUCT { ... } WHERE { ... }")
    prefixes = "".join(f"PREFIX {name}: <{space}>\n" for name, space in shapes.prefixes(rule).items())
    return f"{prefixes}{construct[: head.end()]} {focus} {construct[head.end() :]}"


def _number(shapes: Shapes, node: Node) -> Decimal:
    order = shapes.value(node, "order")
    try:
        return Decimal(order.value) if isinstance(order, Literal) else Decimal(0)
    except InvalidOperation as error:
        raise shapes.fault(node, f"sh:order {order} is no number") from error
