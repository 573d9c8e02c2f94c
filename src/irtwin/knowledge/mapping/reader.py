"""R2RML mapping documents, read and checked (W3C R2RML, sections 4 to 9).

Every fault is an InputError that names the file, the triples map and the term map.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import NoReturn, TypeVar

from pyoxigraph import BlankNode, Literal, NamedNode, RdfFormat, Triple, parse

from irtwin.errors import InputError
from irtwin.knowledge.mapping.document import (
    RR,
    Join,
    LogicalTable,
    MappingDocument,
    PredicateObjectMap,
    TermMap,
    TermType,
    TriplesMap,
)
from irtwin.knowledge.mapping.identifiers import parse_identifier, parse_table, parse_template
from irtwin.knowledge.store.by_subject import BySubject, Node
from irtwin.knowledge.store.rdf_input import parsing, read_rdf
from irtwin.knowledge.vocabulary import TYPE

# BCP 47, as far as it is in use: no language of five letters or more is registered.
_LANGUAGE = re.compile(r"[a-z]{2,3}(?:-[a-z0-9]{1,8})*|[xi](?:-[a-z0-9]{1,8})+", re.IGNORECASE)
_SQL_VERSIONS = {
    *("SQL2008", "Oracle", "MySQL", "MSSQLServer", "HSQLDB", "PostgreSQL", "DB2", "Informix", "Ingres"),
    *("Progress", "SybaseASE", "SybaseSQLAnywhere", "Virtuoso", "Firebird"),
}
_SHORTCUTS = {RR + name for name in ("subject", "predicate", "object", "graph")}
_Parsed = TypeVar("_Parsed")


def read_document(path: Path) -> MappingDocument:
    """Read and check a mapping document in Turtle."""
    file_iri = path.resolve().as_uri()
    content = read_rdf(path, RdfFormat.TURTLE)
    with parsing(path):
        parser = parse(content, RdfFormat.TURTLE, base_iri=file_iri)
        graph = _Graph(quad.triple for quad in parser)
    declared = None if parser.base_iri == file_iri else parser.base_iri
    return MappingDocument(declared, _Reader(path, graph).triples_maps())


class _Graph(BySubject):
    """A document, where a shortcut such as rr:object stands beside the rr:objectMap that it is short for."""

    def __init__(self, triples: Iterable[Triple]) -> None:
        super().__init__(triples, RR)
        for properties in list(self._objects.values()):
            for name in _SHORTCUTS & properties.keys():
                maps: list[Node] = [BlankNode() for _ in properties[name]]
                for node, value in zip(maps, properties[name], strict=True):
                    self._objects[node] = {f"{RR}constant": [value]}
                properties[f"{name}Map"] = maps + properties.get(f"{name}Map", [])


class _Reader:
    """Reads one document; holds its graph, so that each fault can say where it is."""

    def __init__(self, path: Path, graph: _Graph) -> None:
        self.path = path
        self.graph = graph

    def triples_maps(self) -> dict[Node, TriplesMap]:
        nodes: dict[Node, None] = {}  # in the document's order, so that each reading gives the same statements
        for node in self.graph.all():
            typed = NamedNode(f"{RR}TriplesMap") in self.graph.values(node, TYPE.value)
            if typed or self.graph.values(node, "logicalTable") or self.graph.values(node, "subjectMap"):
                nodes[node] = None
            nodes |= dict.fromkeys(self.graph.values(node, "parentTriplesMap"))
        if not nodes:
            raise InputError(f"{self.path}: has no rr:TriplesMap; name an R2RML document")
        return {node: self.triples_map(node) for node in nodes}

    def triples_map(self, node: Node) -> TriplesMap:
        where = f"{self.path}: {_label(node)}"
        self.only(node, where, "logicalTable subjectMap subject predicateObjectMap")
        subject_node, subject = self.subject(node, where)
        return TriplesMap(
            where=where,
            table=self.logical_table(node, where),
            subject=subject,
            classes=tuple(self.iri(item, f"{where}, rr:class") for item in self.graph.values(subject_node, "class")),
            graphs=self.iri_maps(subject_node, "graph", f"{where}, graph map"),
            properties=tuple(
                self.predicate_object_map(item, where) for item in self.graph.values(node, "predicateObjectMap")
            ),
        )

    def logical_table(self, node: Node, where: str) -> LogicalTable:
        table = self.one(node, "logicalTable", where)
        where = f"{where}, logical table"
        self.only(table, where, "tableName sqlQuery sqlVersion")
        for version in self.graph.values(table, "sqlVersion"):
            if getattr(version, "value", "").removeprefix(RR) not in _SQL_VERSIONS:
                self.fault(where, f"{_label(version)} is no SQL version identifier; take rr:SQL2008 or leave it out")
        name, query = self.text(table, "tableName", where), self.text(table, "sqlQuery", where)
        if (name is None) is (query is None):
            self.fault(where, "give either rr:tableName or rr:sqlQuery")
        if name is not None:
            return LogicalTable(where, table=self.parsed(parse_table, name, where))
        return LogicalTable(where, query=query)

    def subject(self, node: Node, where: str) -> tuple[Node, TermMap]:
        """Return the subject map's node and the map."""
        maps = self.graph.values(node, "subjectMap")
        if len(maps) != 1:
            self.fault(where, f"has {len(maps)} subject maps; give one rr:subjectMap or rr:subject")
        allowed = (TermType.IRI, TermType.BLANK_NODE)
        return maps[0], self.term_map(maps[0], f"{where}, subject map", allowed, extra="class graph graphMap")

    def predicate_object_map(self, node: Node, where: str) -> PredicateObjectMap:
        allowed = "predicate predicateMap object objectMap graph graphMap"
        self.only(node, f"{where}, predicate-object map", allowed)
        objects = self.graph.values(node, "objectMap")
        name = next(map(_label, self.graph.values(node, "predicate")), _label(node))
        if not self.graph.values(node, "predicateMap") or not objects:
            self.fault(where, f"predicate-object map {name} needs a predicate and an object")
        return PredicateObjectMap(
            predicates=self.iri_maps(node, "predicate", f"{where}, predicate map of {name}"),
            objects=tuple(self.object_map(item, f"{where}, object map of {name}") for item in objects),
            graphs=self.iri_maps(node, "graph", f"{where}, {name}, graph map"),
        )

    def object_map(self, node: Node, where: str) -> TermMap | Join:
        if self.graph.values(node, "parentTriplesMap"):
            return self.join(node, where)
        return self.term_map(node, where, tuple(TermType), extra="datatype language")

    def iri_maps(self, node: Node, name: str, where: str) -> tuple[TermMap, ...]:
        return tuple(self.term_map(item, where, (TermType.IRI,)) for item in self.graph.values(node, f"{name}Map"))

    def join(self, node: Node, where: str) -> Join:
        self.only(node, where, "parentTriplesMap joinCondition")
        conditions = []
        for item in self.graph.values(node, "joinCondition"):
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
        constants = self.graph.values(node, "constant")
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
        given = self.optional(node, "termType", where)
        if given is None:
            return TermType.LITERAL if literal and TermType.LITERAL in allowed else TermType.IRI
        for kind in allowed:
            if given == NamedNode(RR + kind.value):
                return kind
        names = ", ".join(f"rr:{kind.value}" for kind in allowed)
        self.fault(where, f"term type {_label(given)} is not allowed here; take one of {names}")

    def language(self, node: Node, where: str) -> str | None:
        tag = self.text(node, "language", where)
        if tag is not None and not _LANGUAGE.fullmatch(tag):
            self.fault(where, f"{tag!r} is no language tag; write one like en or en-GB")
        return tag

    def datatype(self, node: Node, where: str) -> NamedNode | None:
        datatype = self.optional(node, "datatype", where)
        return None if datatype is None else self.iri(datatype, f"{where}, rr:datatype")

    def constant(self, node: Node, where: str, required: TermType | None = None) -> TermMap:
        if isinstance(node, NamedNode):
            return TermMap(where, TermType.IRI, constant=node)
        if required is not None or not isinstance(node, Literal):
            self.fault(where, f"the constant {_label(node)} must be an IRI{'' if required else ' or a literal'}")
        return TermMap(where, TermType.LITERAL, constant=node)

    def only(self, node: Node, where: str, allowed: str) -> None:
        """Refuse R2RML properties that do not belong here: misspelt ones would be silently ignored."""
        for predicate in sorted(name for name, _ in self.graph.said_of(node)):
            if predicate.startswith(RR) and predicate.removeprefix(RR) not in allowed.split():
                name = _label(NamedNode(predicate))
                self.fault(where, f"{name} does not belong here; allowed are {', '.join(allowed.split())}")

    def one(self, node: Node, name: str, where: str) -> Node:
        value = self.optional(node, name, where)
        if value is None:
            self.fault(where, f"rr:{name} is missing")
        return value

    def optional(self, node: Node, name: str, where: str) -> Node | None:
        values = self.graph.values(node, name)
        if len(values) > 1:
            self.fault(where, f"{len(values)} values of rr:{name}; give one")
        return values[0] if values else None

    def text(self, node: Node, name: str, where: str) -> str | None:
        literal = self.optional(node, name, where)
        if literal is not None and not isinstance(literal, Literal):
            self.fault(where, f"rr:{name} must be a string")
        return None if literal is None else literal.value

    def iri(self, node: Node, where: str) -> NamedNode:
        if not isinstance(node, NamedNode):
            self.fault(where, f"{_label(node)} must be an IRI")
        return node

    def parsed(self, parse: Callable[[str], _Parsed], text: str, where: str) -> _Parsed:
        try:
            return parse(text)
        except ValueError as error:
            message = str(error)
            self.fault(where, message if len(message) < 200 else f"{message[:200]}...")

    def fault(self, where: str, message: str) -> NoReturn:
        raise InputError(f"{where}: {message}")


def _label(node: Node) -> str:
    if isinstance(node, BlankNode | Triple):
        return "[...]"
    if isinstance(node, Literal):
        return repr(node.value)
    if node.value.startswith(RR):
        return f"rr:{node.value.removeprefix(RR)}"
    return f"<{re.split('[/#]', node.value)[-1] or node.value}>"
