"""SHACL shapes as SPARQL: whether a node conforms to a shape is a condition, a path is a property path."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from itertools import combinations, count

from pyoxigraph import BlankNode, Literal, NamedNode, Triple

from irtwin.errors import InputError
from irtwin.knowledge.vocabulary import RDF, SH, shorten

Node = NamedNode | BlankNode | Literal | Triple
MOST_COUNTED = 6  # so many values are told apart pair by pair

_PATHS = {"zeroOrMorePath": "({})*", "oneOrMorePath": "({})+", "zeroOrOnePath": "({})?", "inversePath": "^({})"}
_COMPARED = {"minInclusive": ">=", "minExclusive": ">", "maxInclusive": "<=", "maxExclusive": "<"}
_KINDS = {
    "IRI": "isIRI({0})",
    "BlankNode": "isBlank({0})",
    "Literal": "isLiteral({0})",
    "BlankNodeOrIRI": "!isLiteral({0})",
    "BlankNodeOrLiteral": "!isIRI({0})",
    "IRIOrLiteral": "!isBlank({0})",
}
_SAY_NOTHING = {"path", "name", "description", "order", "group", "message", "severity", "deactivated", "rule", "flags"}
_TARGETS = {"targetClass", "targetNode", "targetSubjectsOf", "targetObjectsOf"}


class Shapes:
    """The triples of a shapes graph, and what they mean in SPARQL."""

    def __init__(self, triples: Iterable[Triple], source: str):
        self.source = source
        self._objects: dict[object, dict[str, list[Node]]] = {}
        self._numbers = count()
        for triple in sorted(triples, key=str):
            self._objects.setdefault(triple.subject, {}).setdefault(triple.predicate.value, []).append(triple.object)

    def subjects(self, name: str) -> list[Node]:
        """Return the nodes that have a property of SHACL's."""
        return [subject for subject, found in self._objects.items() if SH + name in found]  # type: ignore[misc]

    def values(self, node: object, name: str) -> list[Node]:
        """Return the values of a property of SHACL's, or of any by its whole IRI."""
        return self._objects.get(node, {}).get(name if ":" in name else SH + name, [])

    def value(self, node: object, name: str) -> Node | None:
        """Return the one value of a property, or None."""
        return next(iter(self.values(node, name)), None)

    def items(self, node: object) -> Iterator[Node]:
        """Return the items of an RDF list."""
        seen = set()
        while node not in seen and self.values(node, RDF + "first"):
            seen.add(node)
            yield self.values(node, RDF + "first")[0]
            node = self.value(node, RDF + "rest")

    def is_deactivated(self, node: object) -> bool:
        """Whether a shape or rule is switched off."""
        off = self.value(node, "deactivated")
        return isinstance(off, Literal) and off.value in ("true", "1")

    def fault(self, node: object, what: str) -> InputError:
        """Return the error of a shape that cannot be understood."""
        return InputError(f"{self.source}: {shorten(getattr(node, 'value', str(node)))}: {what}")

    def fresh(self) -> str:
        """Return a variable that nobody uses."""
        return f"?_{next(self._numbers)}"

    def path(self, node: Node) -> str:
        """Return a SHACL path as a SPARQL property path."""
        if isinstance(node, NamedNode):
            return str(node)
        for name, form in _PATHS.items():
            for inner in self.values(node, name):
                return form.format(self.path(inner))
        for alternatives in self.values(node, "alternativePath"):
            return "(" + "|".join(map(self.path, self.items(alternatives))) + ")"
        steps = [self.path(step) for step in self.items(node)]
        if not steps:
            raise self.fault(node, "is no SHACL path")
        return "(" + "/".join(steps) + ")"

    def condition(self, shape: Node, variable: str) -> str:
        """Return the SPARQL condition under which the variable's value conforms to a shape."""
        if self.is_deactivated(shape):
            return "true"
        if self.values(shape, "path"):
            return self._property(shape, variable)
        return _all(self._constraints(shape, variable))

    def _property(self, shape: Node, variable: str) -> str:
        path, value = self.path(self.values(shape, "path")[0]), self.fresh()
        each = _all(self._constraints(shape, value, counted=path, owner=variable))
        held = [] if each == "true" else [f"NOT EXISTS {{ {variable} {path} {value} FILTER(!({each})) }}"]
        counts = [
            *(self._at_least(shape, variable, path, least) for least in self.values(shape, "minCount")),
            *(f"!({self._at_least(shape, variable, path, most, 1)})" for most in self.values(shape, "maxCount")),
            *(f"EXISTS {{ {variable} {path} {value} }}" for value in self.values(shape, "hasValue")),
        ]
        return _all([*held, *counts])

    def _at_least(self, shape: Node, variable: str, path: str, number: Node, more: int = 0) -> str:
        wanted = int(number.value) + more if isinstance(number, Literal) else 0
        if wanted > MOST_COUNTED:
            raise self.fault(shape, f"counts to more than {MOST_COUNTED - 1}, which a condition of a rule cannot")
        values = [self.fresh() for _ in range(wanted)]
        if not values:
            return "true"
        patterns = " ".join(f"{variable} {path} {value} ." for value in values)
        apart = "".join(f" FILTER(!sameTerm({one}, {other}))" for one, other in combinations(values, 2))
        return f"EXISTS {{ {patterns}{apart} }}"

    def _constraints(self, shape: Node, variable: str, counted: str = "", owner: str = "") -> Iterator[str]:
        counts = {"minCount", "maxCount", "hasValue"} if counted else set()
        for name, values in self._objects.get(shape, {}).items():
            local = name.removeprefix(SH)
            if local == name or local in _SAY_NOTHING | _TARGETS | counts:
                continue
            write = _CONSTRAINTS.get(local)
            if write is None:
                raise self.fault(shape, f"sh:{local} cannot be a condition of a rule")
            for value in values:
                yield write(self, shape, variable, value)


def _all(conditions: Iterable[str]) -> str:
    return " && ".join(f"({condition})" for condition in conditions if condition != "true") or "true"


def _class(shapes: Shapes, shape: Node, variable: str, value: Node) -> str:
    return f"EXISTS {{ {variable} rdf:type/rdfs:subClassOf* {value} }}"


def _comparison(operator: str) -> Callable[[Shapes, Node, str, Node], str]:
    return lambda shapes, shape, variable, value: f"COALESCE({variable} {operator} {value}, false)"


def _length(operator: str) -> Callable[[Shapes, Node, str, Node], str]:
    return lambda shapes, shape, variable, value: (
        f"!isBlank({variable}) && COALESCE(STRLEN(STR({variable})) {operator} {value}, false)"
    )


def _pattern(shapes: Shapes, shape: Node, variable: str, value: Node) -> str:
    flags = shapes.value(shape, "flags")
    arguments = f"STR({variable}), {value}" + ("" if flags is None else f", {flags}")
    return f"!isBlank({variable}) && COALESCE(REGEX({arguments}), false)"


def _kind(shapes: Shapes, shape: Node, variable: str, value: Node) -> str:
    form = _KINDS.get(getattr(value, "value", "").removeprefix(SH))
    if form is None:
        raise shapes.fault(shape, f"{value} is no sh:nodeKind")
    return form.format(variable)


def _in(shapes: Shapes, shape: Node, variable: str, value: Node) -> str:
    return " || ".join(f"sameTerm({variable}, {item})" for item in shapes.items(value)) or "false"


def _one_of(shapes: Shapes, shape: Node, variable: str, value: Node) -> str:
    return " || ".join(f"({shapes.condition(item, variable)})" for item in shapes.items(value)) or "false"


def _every(shapes: Shapes, shape: Node, variable: str, value: Node) -> str:
    return _all(shapes.condition(item, variable) for item in shapes.items(value))


def _exactly_one(shapes: Shapes, shape: Node, variable: str, value: Node) -> str:
    counted = (f"IF({shapes.condition(item, variable)}, 1, 0)" for item in shapes.items(value))
    return f"({' + '.join(counted)}) = 1"


_CONSTRAINTS: dict[str, Callable[[Shapes, Node, str, Node], str]] = {
    "class": _class,
    "datatype": lambda _, __, variable, value: f"isLiteral({variable}) && datatype({variable}) = {value}",
    "nodeKind": _kind,
    **{name: _comparison(operator) for name, operator in _COMPARED.items()},
    "minLength": _length(">="),
    "maxLength": _length("<="),
    "pattern": _pattern,
    "hasValue": lambda _, __, variable, value: f"sameTerm({variable}, {value})",
    "in": _in,
    "node": lambda shapes, _, variable, value: shapes.condition(value, variable),
    "property": lambda shapes, _, variable, value: shapes.condition(value, variable),
    "not": lambda shapes, _, variable, value: f"!({shapes.condition(value, variable)})",
    "and": _every,
    "or": _one_of,
    "xone": _exactly_one,
}
