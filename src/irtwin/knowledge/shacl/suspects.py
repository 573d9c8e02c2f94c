"""Whether nodes may break a constraint, by one SPARQL query a shape: only then a SHACL engine, a slow one, is asked.

A shape becomes a condition that its nodes keep; those of which it is not known to be true are suspects. The condition
may be too strict, never too lax: what a shape says in words that are not known here makes all its nodes suspects.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from itertools import count
from typing import cast

from pyoxigraph import Literal, NamedNode, QuerySolutions, Store, Triple

from irtwin.knowledge.shacl.shapes import TARGETS, Shapes
from irtwin.knowledge.store.by_subject import BySubject, Node
from irtwin.knowledge.vocabulary import PREFIXES, RDF, RDFS, SH, XSD

_KIND = "?_kind"
_THIS = "?this"
_BY_LITERAL = {  # what is true of a node by the literal of a constraint
    "minInclusive": "{node} >= {value}",
    "minExclusive": "{node} > {value}",
    "maxInclusive": "{node} <= {value}",
    "maxExclusive": "{node} < {value}",
    "minLength": "(!isBlank({node}) && STRLEN(STR({node})) >= {value})",
    "pattern": "(!isBlank({node}) && REGEX(STR({node}), {value}))",  # with `flags` it is not known
}
_BESIDE = {"lessThan": "<", "lessThanOrEquals": "<="}
_SAYS_NOTHING = {SH + name for name in ("message", "severity", "name", "description", "order", "group", "rule")}
_SAYS_NOTHING |= {RDF + "type", RDFS + "label", RDFS + "comment", SH + "path"}
_SAYS_NOTHING |= {SH + name for name in TARGETS}
_TEXT = XSD + "string"


class _Unknown(Exception):
    """A constraint that is not known here."""


def queries(triples: Iterable[Triple], classes: Iterable[Triple]) -> Iterator[str]:
    """Yield queries of a shapes graph, at least one for each shape that has targets; each selects suspects as `$this`.

    classes: what the data say by rdfs:subClassOf.
    """
    return _Writer(Shapes(triples, "shapes"), classes).queries()


def any_suspect(store: Store, asked: Iterable[str]) -> bool:
    """Whether a query finds a node in a store's default graph."""
    return any(True for text in asked for _ in cast(QuerySolutions, store.query(text, prefixes=PREFIXES)))


class _Writer:
    def __init__(self, shapes: Shapes, classes: Iterable[Triple]):
        self._shapes = shapes
        self._below = BySubject(
            (Triple(above, name, kind) for kind, name, above in classes if not isinstance(above, Literal)), RDFS
        )
        self._numbers = count()

    def queries(self) -> Iterator[str]:
        for shape in self._shapes.all():
            targets = " UNION ".join(f"{{ {target} }}" for target in self._targets(shape))
            if not targets or self._shapes.is_deactivated(shape):
                continue
            focus = f"{{ SELECT DISTINCT $this {{ {targets} }} }}"  # each node once, however often it is a target
            try:
                if self._shapes.values(shape, "path"):
                    conditions = list(self._of_values(shape, _THIS))
                else:
                    conditions = list(self._conditions(shape, _THIS, with_queries=False))
            except _Unknown:
                conditions = ["false"]
            if conditions:
                yield f"SELECT DISTINCT $this {{ {focus} FILTER(!COALESCE({' && '.join(conditions)}, false)) }}"
            for text in map(self._select, self._shapes.values(shape, "sparql")):
                yield f"SELECT DISTINCT $this {{ {focus} {{ {text} }} }}"

    def _targets(self, shape: Node) -> Iterator[str]:
        for name, value in self._shapes.targets(shape):
            of_kind = name == "targetClass"  # whose classes are known
            yield f"$this a {_KIND} {self._of_kind(_KIND, value)}" if of_kind else TARGETS[name].format(value)

    def _of_kind(self, variable: str, kind: Node) -> str:
        """Return what is true of a variable that is a class, or below it."""
        kinds = self._below.reached(kind, "subClassOf")
        if all(isinstance(node, NamedNode) for node in kinds):
            names = sorted(map(str, kinds))
            if variable == _KIND:  # its individuals are looked up
                return f"VALUES {variable} {{ {' '.join(names)} }}"
            return f"FILTER({variable} IN ({', '.join(names)}))"
        return f". {variable} rdfs:subClassOf* {kind}"  # some have no name

    def _conditions(self, shape: Node, node: str, *, with_queries: bool = True) -> Iterator[str]:
        """Yield what is true of a node that keeps a shape; its queries are asked apart, or are not known."""
        for name, values in self._shapes.said_of(shape):
            if name in _SAYS_NOTHING or (name == SH + "sparql" and not with_queries):
                continue
            for value in values:
                yield self._condition(name.removeprefix(SH), value, node)

    def _condition(self, name: str, value: Node, node: str) -> str:
        if name == "property":
            return " && ".join(self._of_values(value, node)) or "true"
        if name == "node":
            return " && ".join(self._conditions(value, node)) or "true"
        if name == "or":
            either = [" && ".join(self._conditions(shape, node)) or "true" for shape in self._shapes.items(value)]
            return f"({' || '.join(f'COALESCE({condition}, false)' for condition in either) or 'false'})"
        if name == "class":
            kind = self._name()
            return f"EXISTS {{ {node} a {kind} {self._of_kind(kind, value)} }}"
        if name == "datatype":
            is_text = isinstance(value, NamedNode) and value.value == _TEXT
            well_formed = "true" if is_text else f"{value}(STR({node})) = {node}"
            return f"(datatype({node}) = {value} && {well_formed})"
        if name == "in":
            return self._is_in(node, self._shapes.items(value))
        if name in _BY_LITERAL and isinstance(value, Literal):
            return _BY_LITERAL[name].format(node=node, value=value)
        raise _Unknown(name)

    def _of_values(self, shape: Node, node: str) -> Iterator[str]:
        """Yield what is true of a node whose values of a property keep a shape of these."""
        path = self._path(self._shapes.value(shape, "path"))
        for name, values in self._shapes.said_of(shape):
            short = name.removeprefix(SH)
            if name in _SAYS_NOTHING:
                continue
            for value in values:
                variable, other = self._name(), self._name()
                if short == "minCount" and value == _integer(1):
                    yield f"EXISTS {{ {node} {path} {variable} }}"
                elif short == "maxCount" and value == _integer(0):
                    yield f"NOT EXISTS {{ {node} {path} {variable} }}"
                elif short == "maxCount" and value == _integer(1):
                    several = f"{node} {path} {variable} , {other} FILTER(!sameTerm({variable}, {other}))"
                    yield f"NOT EXISTS {{ {several} }}"
                elif short in _BESIDE:
                    keeps = f"{variable} {_BESIDE[short]} {other}"
                    both = f"{node} {path} {variable} ; {value} {other}"
                    yield f"NOT EXISTS {{ {both} FILTER(!COALESCE({keeps}, false)) }}"
                else:
                    keeps = self._condition(short, value, variable)
                    yield f"NOT EXISTS {{ {node} {path} {variable} FILTER(!COALESCE({keeps}, false)) }}"

    def _select(self, constraint: Node) -> str:
        """Return a constraint's query; an empty one, which suspects all, where its prefixes are not the usual ones."""
        known = self._shapes.prefixes(constraint).items() <= PREFIXES.items()
        return self._shapes.text(constraint, "select") if known else ""

    def _path(self, path: Node | None) -> str:
        if isinstance(path, NamedNode):
            return str(path)
        inverse = self._shapes.value(path, "inversePath")
        if isinstance(inverse, NamedNode):
            return f"^{inverse}"
        ways = self._shapes.items(self._shapes.value(path, "alternativePath"))
        if ways:
            return f"({'|'.join(map(self._path, ways))})"
        raise _Unknown("path")

    def _is_in(self, node: str, items: list[Node]) -> str:
        if not all(isinstance(item, NamedNode) or _is_plain(item) for item in items):
            raise _Unknown("in")  # numbers are equal to others that are written otherwise
        return f"{node} IN ({', '.join(map(str, items))})"

    def _name(self) -> str:
        return f"?_v{next(self._numbers)}"


def _is_plain(term: Node) -> bool:
    return isinstance(term, Literal) and term.datatype.value == _TEXT


def _integer(number: int) -> Literal:
    return Literal(str(number), datatype=NamedNode(XSD + "integer"))
