"""R2RML mapping documents, read and checked (W3C R2RML, sections 4 to 9).

Every fault is an InputError that names the file, the triples map and the term map.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from enum import Enum
from pathlib import Path
from typing import NoReturn, TypeVar

import pyoxigraph as ox
from rdflib import RDF, BNode, Graph, Literal, Namespace, URIRef
from rdflib.term import Node

from irtwin.errors import InputError
from irtwin.knowledge.mapping.identifiers import Identifier, parse_identifier, parse_table, parse_template

RR = Namespace("http://www.w3.org/ns/r2rml#")
_BASE = re.compile(r"^\s*(?:@base|base)\s+<([^<>\s]+)>", re.IGNORECASE | re.MULTILINE)
# BCP 47, as far as it is in use: no language of five letters or more is registered.
_LANGUAGE = re.compile(r"[a-z]{2,3}(?:-[a-z0-9]{1,8})*|[xi](?:-[a-z0-9]{1,8})+", re.IGNORECASE)
_SQL_VERSIONS = {
    *(RR.SQL2008, RR.Oracle, RR.MySQL, RR.MSSQLServer, RR.HSQLDB, RR.PostgreSQL, RR.DB2, RR.Informix, RR.Ingres),
    *(RR.Progress, RR.SybaseASE, RR.SybaseSQLAnywhere, RR.Virtuoso, RR.Firebird),
}
_Parsed = TypeVar("_Parsed")


class TermType(Enum):
    """The kind of term that a map makes; the value is its local name in R2RML."""

    IRI = "IRI"
    BLANK_NODE = "BlankNode"
    LITERAL = "Literal"


@dataclass(frozen=True)
class LogicalTable:
    """A table or view by its name, or a query; just one of them is given."""

    where: str
    table: tuple[Identifier, ...] = ()
    query: str | None = None


@dataclass(frozen=True)
class TermMap:
    """How a term is made of a row: a constant, a column or a template; `where` names it in messages."""

    where: str
    term_type: TermType
    constant: ox.NamedNode | ox.Literal | None = None
    column: Identifier | None = None
    template: tuple[str | Identifier, ...] = ()
    datatype: ox.NamedNode | None = None
    language: str | None = None

    @property
    def columns(self) -> tuple[Identifier, ...]:
        """The columns that the term is made of."""
        named = tuple(part for part in self.template if isinstance(part, Identifier))
        return named if self.column is None else (self.column,)


@dataclass(frozen=True)
class Join:
    """The subject of another triples map, of rows where child and parent columns are equal."""

    where: str
    parent: Node
    conditions: tuple[tuple[Identifier, Identifier], ...]


@dataclass(frozen=True)
class PredicateObjectMap:
    """Predicates and objects to combine, in the graphs given here beside the subject's."""

    predicates: tuple[TermMap, ...]
    objects: tuple[TermMap | Join, ...]
    graphs: tuple[TermMap, ...]


@dataclass(frozen=True)
class TriplesMap:
    """What the rows of one logical table become."""

    where: str
    table: LogicalTable
    subject: TermMap
    classes: tuple[ox.NamedNode, ...]
    graphs: tuple[TermMap, ...]
    properties: tuple[PredicateObjectMap, ...]


@dataclass(frozen=True)
class Document:
    """A mapping document; `base_iri` is the one it declares, if any."""

    base_iri: str | None
    triples_maps: dict[Node, TriplesMap]


def read_document(path: Path) -> Document:
    """Read and check a mapping document in Turtle."""
    try:
        text = path.read_text(encoding="utf-8")
        graph = Graph().parse(data=text, format="turtle", publicID=path.resolve().as_uri())
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    except (SyntaxError, ValueError) as error:  # rdflib's BadSyntax is a SyntaxError
        raise InputError(f"{path}: no valid Turtle: {' '.join(str(error).split())[:300]}") from None
    base = _BASE.search(text)
    return Document(base[1] if base else None, _Reader(path, graph).triples_maps())


class _Reader:
    """Reads one document; holds its graph, so that each fault can say where it is."""

    def __init__(self, path: Path, graph: Graph) -> None:
        self.path = path
        self.graph = graph

    def triples_maps(self) -> dict[Node, TriplesMap]:
        nodes = set(self.graph.subjects(RDF.type, RR.TriplesMap))
        for name in ("logicalTable", "subjectMap", "subject"):
            nodes |= set(self.graph.subjects(RR[name]))
        nodes |= set(self.graph.objects(None, RR.parentTriplesMap))
        if not nodes:
            raise InputError(f"{self.path}: no rr:TriplesMap in it")
        return {node: self.triples_map(node) for node in _sorted(nodes)}

    def triples_map(self, node: Node) -> TriplesMap:
        where = f"{self.path}: {_label(node)}"
        self.only(node, where, "logicalTable subjectMap subject predicateObjectMap")
        subject_node, subject = self.subject(node, where)
        return TriplesMap(
            where=where,
            table=self.logical_table(node, where),
            subject=subject,
            classes=self.classes(subject_node, where),
            graphs=self.graphs(subject_node, where),
            properties=tuple(
                self.predicate_object_map(item, where)
                for item in _sorted(self.graph.objects(node, RR.predicateObjectMap))
            ),
        )

    def logical_table(self, node: Node, where: str) -> LogicalTable:
        table = self.one(node, "logicalTable", where)
        where = f"{where}, logical table"
        self.only(table, where, "tableName sqlQuery sqlVersion")
        for version in self.graph.objects(table, RR.sqlVersion):
            if version not in _SQL_VERSIONS:
                self.fault(where, f"{_label(version)} is no SQL version identifier; take rr:SQL2008 or leave it out")
        name, query = self.text(table, "tableName", where), self.text(table, "sqlQuery", where)
        if (name is None) is (query is None):
            self.fault(where, "give either rr:tableName or rr:sqlQuery")
        if name is not None:
            return LogicalTable(where, table=self.parsed(parse_table, name, where))
        return LogicalTable(where, query=query)

    def subject(self, node: Node, where: str) -> tuple[Node | None, TermMap]:
        """Return the subject map's node (None for the shortcut rr:subject) and the map."""
        maps = self.maps(node, "subject", where)
        if len(maps) != 1:
            self.fault(where, f"has {len(maps)} subject maps; give one rr:subjectMap or rr:subject")
        kind, item = maps[0]
        where = f"{where}, subject map"
        if kind == "constant":
            return None, self.constant(item, where, TermType.IRI)
        allowed = (TermType.IRI, TermType.BLANK_NODE)
        return item, self.term_map(item, where, allowed, extra="class graph graphMap")

    def classes(self, node: Node | None, where: str) -> tuple[ox.NamedNode, ...]:
        found = [] if node is None else _sorted(self.graph.objects(node, RR["class"]))
        return tuple(self.iri(item, f"{where}, rr:class") for item in found)

    def graphs(self, node: Node | None, where: str) -> tuple[TermMap, ...]:
        where = f"{where}, graph map"
        found = [] if node is None else self.maps(node, "graph", where)
        return tuple(self.shortcut_or_map(kind, item, where) for kind, item in found)

    def predicate_object_map(self, node: Node, where: str) -> PredicateObjectMap:
        allowed = "predicate predicateMap object objectMap graph graphMap"
        self.only(node, f"{where}, predicate-object map", allowed)
        predicates = self.maps(node, "predicate", where)
        objects = self.maps(node, "object", where)
        name = next((_label(item) for kind, item in predicates if kind == "constant"), _label(node))
        if not predicates or not objects:
            self.fault(where, f"predicate-object map {name} needs a predicate and an object")
        return PredicateObjectMap(
            predicates=tuple(
                self.shortcut_or_map(kind, item, f"{where}, predicate map of {name}") for kind, item in predicates
            ),
            objects=tuple(self.object_map(kind, item, f"{where}, object map of {name}") for kind, item in objects),
            graphs=self.graphs(node, f"{where}, {name}"),
        )

    def object_map(self, kind: str, node: Node, where: str) -> TermMap | Join:
        if kind == "constant":
            return self.constant(node, where)
        if (node, RR.parentTriplesMap, None) in self.graph:
            return self.join(node, where)
        return self.term_map(node, where, tuple(TermType), extra="datatype language")

    def shortcut_or_map(self, kind: str, node: Node, where: str) -> TermMap:
        if kind == "constant":
            return self.constant(node, where, TermType.IRI)
        return self.term_map(node, where, (TermType.IRI,))

    def join(self, node: Node, where: str) -> Join:
        self.only(node, where, "parentTriplesMap joinCondition")
        conditions = []
        for item in _sorted(self.graph.objects(node, RR.joinCondition)):
            self.only(item, where, "child parent")
            sides = [self.text(item, side, where) for side in ("child", "parent")]
            if sides[0] is None or sides[1] is None:
                self.fault(where, "a join condition needs rr:child and rr:parent")
            conditions.append(
                (self.parsed(parse_identifier, sides[0], where), self.parsed(parse_identifier, sides[1], where))
            )
        return Join(where, self.one(node, "parentTriplesMap", where), tuple(conditions))

    def term_map(self, node: Node, where: str, allowed: tuple[TermType, ...], extra: str = "") -> TermMap:
        self.only(node, where, f"constant column template termType inverseExpression {extra}")
        constants = list(self.graph.objects(node, RR.constant))
        column, template = self.text(node, "column", where), self.text(node, "template", where)
        if len(constants) + (column is not None) + (template is not None) != 1:
            self.fault(where, "give just one of rr:constant, rr:column and rr:template")
        if constants:
            return self.constant(constants[0], where, None if TermType.LITERAL in allowed else TermType.IRI)
        language, datatype = self.language(node, where), self.datatype(node, where)
        term_type = self.term_type(node, where, allowed, literal=bool(column or language or datatype))
        if term_type is not TermType.LITERAL and (language or datatype):
            self.fault(where, "rr:language and rr:datatype are for literals only")
        if language and datatype:
            self.fault(where, "give rr:language or rr:datatype, not both")
        return TermMap(
            where=where,
            term_type=term_type,
            column=None if column is None else self.parsed(parse_identifier, column, where),
            template=() if template is None else self.parsed(parse_template, template, where),
            datatype=datatype,
            language=language,
        )

    def term_type(self, node: Node, where: str, allowed: tuple[TermType, ...], literal: bool) -> TermType:
        found = self.optional(node, "termType", where)
        if found is None:
            return TermType.LITERAL if literal and TermType.LITERAL in allowed else TermType.IRI
        for kind in allowed:
            if found == RR[kind.value]:
                return kind
        names = ", ".join(f"rr:{kind.value}" for kind in allowed)
        self.fault(where, f"term type {_label(found)} is not allowed here; take one of {names}")

    def language(self, node: Node, where: str) -> str | None:
        tag = self.text(node, "language", where)
        if tag is not None and not _LANGUAGE.fullmatch(tag):
            self.fault(where, f"{tag!r} is no language tag; write one like en or en-GB")
        return tag

    def datatype(self, node: Node, where: str) -> ox.NamedNode | None:
        found = self.optional(node, "datatype", where)
        return None if found is None else self.iri(found, f"{where}, rr:datatype")

    def constant(self, node: Node, where: str, required: TermType | None = None) -> TermMap:
        if isinstance(node, URIRef):
            return TermMap(where, TermType.IRI, constant=self.iri(node, where))
        if required is not None or not isinstance(node, Literal):
            self.fault(where, f"the constant {_label(node)} must be an IRI{'' if required else ' or a literal'}")
        if node.language:
            value = ox.Literal(str(node), language=node.language)
        else:
            value = ox.Literal(str(node), datatype=ox.NamedNode(str(node.datatype)) if node.datatype else None)
        return TermMap(where, TermType.LITERAL, constant=value)

    def maps(self, node: Node, name: str, where: str) -> list[tuple[str, Node]]:
        """Return the term maps given by rr:NAMEMap and by the shortcut rr:NAME, with which of them it is."""
        shortcuts = [("constant", item) for item in _sorted(self.graph.objects(node, RR[name]))]
        return shortcuts + [("map", item) for item in _sorted(self.graph.objects(node, RR[f"{name}Map"]))]

    def only(self, node: Node, where: str, allowed: str) -> None:
        """Refuse R2RML properties that do not belong here: misspelt ones would be silently ignored."""
        for predicate in _sorted(set(self.graph.predicates(node))):
            if str(predicate).startswith(str(RR)) and str(predicate).removeprefix(str(RR)) not in allowed.split():
                self.fault(where, f"{_label(predicate)} does not belong here; allowed are {', '.join(allowed.split())}")

    def one(self, node: Node, name: str, where: str) -> Node:
        found = self.optional(node, name, where)
        if found is None:
            self.fault(where, f"rr:{name} is missing")
        return found

    def optional(self, node: Node, name: str, where: str) -> Node | None:
        found = list(self.graph.objects(node, RR[name]))
        if len(found) > 1:
            self.fault(where, f"{len(found)} values of rr:{name}; give one")
        return found[0] if found else None

    def text(self, node: Node, name: str, where: str) -> str | None:
        found = self.optional(node, name, where)
        if found is not None and not isinstance(found, Literal):
            self.fault(where, f"rr:{name} must be a string")
        return None if found is None else str(found)

    def iri(self, node: Node, where: str) -> ox.NamedNode:
        if not isinstance(node, URIRef):
            self.fault(where, f"{_label(node)} must be an IRI")
        try:
            return ox.NamedNode(str(node))
        except ValueError as error:
            self.fault(where, f"{_label(node)} is no valid IRI: {error}")

    def parsed(self, parse: Callable[[str], _Parsed], text: str, where: str) -> _Parsed:
        try:
            return parse(text)
        except ValueError as error:
            self.fault(where, str(error))

    def fault(self, where: str, message: str) -> NoReturn:
        raise InputError(f"{where}: {message}")


def _sorted(nodes: Iterable[Node]) -> list[Node]:
    return sorted(nodes, key=str)


def _label(node: Node) -> str:
    if isinstance(node, BNode):
        return "[...]"
    text = str(node)
    if text.startswith(str(RR)):
        return f"rr:{text.removeprefix(str(RR))}"
    return f"<{re.split('[/#]', text)[-1] or text}>" if isinstance(node, URIRef) else repr(text)
