"""From triples maps to statements: one query each, and what its rows become."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

from pyoxigraph import DefaultGraph, NamedNode, Quad
from sqlalchemy import Connection

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
from irtwin.knowledge.mapping.identifiers import Identifier, quoted
from irtwin.knowledge.mapping.source import TableSource, describe
from irtwin.knowledge.mapping.terms import Row, RowColumn, TermMaker, term_maker
from irtwin.knowledge.vocabulary import TYPE

GraphName = NamedNode | DefaultGraph
GraphMaker = Callable[[Row], Sequence[GraphName]]

_DEFAULT_GRAPH = NamedNode(f"{RR}defaultGraph")


@dataclass(frozen=True)
class PlannedProperty:
    """Predicates and objects to combine; in the subject's graphs where `graphs` is None."""

    predicates: tuple[TermMaker, ...]
    objects: tuple[TermMaker, ...]
    graphs: GraphMaker | None


@dataclass(frozen=True)
class Statement:
    """A query, and the makers of the terms that each of its rows becomes.

    table: the name of the one table that it reads, empty for a query of the document's or a join;
    columns: what its rows hold of that table, in order.
    """

    where: str
    sql: str
    table: tuple[Identifier, ...]
    columns: tuple[str, ...]
    subject: TermMaker
    graphs: GraphMaker
    properties: tuple[PlannedProperty, ...]

    def quads(self, row: Row) -> list[Quad]:
        """Return what a row becomes (W3C R2RML, section 11.1). Raises InputError where it does not fit."""
        subject = self.subject(row)
        if subject is None:
            return []
        own = self.graphs(row)
        templates = []
        for item in self.properties:
            graphs = own if item.graphs is None else item.graphs(row)
            predicates = [make(row) for make in item.predicates]
            objects = [make(row) for make in item.objects]
            # Document checks leave only an IRI or blank node as subject, and an IRI as predicate.
            templates += [
                Quad(subject, predicate, value, graph)  # type: ignore[arg-type]
                for predicate in predicates
                if predicate is not None
                for value in objects
                if value is not None
                for graph in graphs
            ]
        return templates


def plan(connection: Connection, document: MappingDocument, base_iri: str) -> Iterator[Statement]:
    """Yield a document's statements. Raises InputError where its tables or columns are not there."""
    sources: dict[LogicalTable, TableSource] = {}

    def source(table: LogicalTable) -> TableSource:
        if table not in sources:
            sources[table] = describe(connection, table)
        return sources[table]

    def select(**sides: LogicalTable) -> _Select:
        return _Select(connection, {side: source(table) for side, table in sides.items()}, base_iri)

    maps = document.triples_maps
    for triples_map in maps.values():
        yield _plain(select(child=triples_map.table), triples_map, document)
        for item in triples_map.properties:
            for join in item.objects:
                if isinstance(join, Join) and join.conditions:
                    parent = maps[join.parent]
                    sides = select(child=triples_map.table, parent=parent.table)
                    sides.join(join)
                    objects = (sides.maker(parent.subject, "parent"),)
                    yield _statement(sides, triples_map, [_property(sides, triples_map, item, objects)])


class _Select:
    """A query under construction: it gathers the columns that term maps need, each once."""

    def __init__(self, connection: Connection, sources: Mapping[str, TableSource], base_iri: str) -> None:
        self.sources = sources
        self.base_iri = base_iri
        self.preparer = connection.dialect.identifier_preparer
        self.chosen: dict[tuple[str, str], int] = {}  # side and column
        self.conditions: list[str] = []

    def maker(self, term_map: TermMap, side: str = "child") -> TermMaker:
        columns = {item: self.column(item, term_map.where, side) for item in term_map.columns}
        return term_maker(term_map, columns, self.base_iri)

    def makers(self, term_maps: Iterable[TermMap]) -> tuple[TermMaker, ...]:
        return tuple(self.maker(term_map) for term_map in term_maps)

    def graphs(self, term_maps: Sequence[TermMap]) -> GraphMaker:
        """Return the maker of the graphs that the maps name: none where a column is NULL."""
        if not term_maps:
            return lambda row: (DefaultGraph(),)
        makers = self.makers(term_maps)
        constant = all(term_map.constant is not None for term_map in term_maps)

        def make(row: Row) -> Sequence[GraphName]:
            names = {maker(row) for maker in makers} - {None}
            return [DefaultGraph() if name == _DEFAULT_GRAPH else name for name in names]  # type: ignore[misc]

        if not constant:
            return make
        fixed = make(())
        return lambda row: fixed

    def column(self, identifier: Identifier, where: str, side: str) -> RowColumn:
        source = self.sources[side]
        name = source.column(identifier, where)
        index = self.chosen.setdefault((side, name), len(self.chosen))
        return index, source.columns[name]

    def join(self, join: Join) -> None:
        for child, parent in join.conditions:
            sides = (("child", child), ("parent", parent))
            names = [self.qualified(side, self.sources[side].column(item, join.where)) for side, item in sides]
            self.conditions.append(" = ".join(names))

    def qualified(self, side: str, name: str) -> str:
        return f"{side}.{quoted(name, self.preparer)}"

    def selected(self, side: str, name: str) -> str:
        column = self.qualified(side, name)
        return f"CAST({column} AS VARCHAR)" if name in self.sources[side].cast else column

    @property
    def sql(self) -> str:
        tables = ", ".join(f"{source.sql} {side}" for side, source in self.sources.items())
        condition = f" WHERE {' AND '.join(self.conditions)}" if self.conditions else ""
        columns = ", ".join(self.selected(*column) for column in self.chosen)
        return f"SELECT {columns or '1'} FROM {tables}{condition}"


def _plain(select: _Select, triples_map: TriplesMap, document: MappingDocument) -> Statement:
    """The statement of a logical table alone: classes, and all objects that need no join."""
    rdf_type = select.maker(_constant(TYPE))
    properties = [PlannedProperty((rdf_type,), (select.maker(_constant(name)),), None) for name in triples_map.classes]
    for item in triples_map.properties:
        objects = [
            document.triples_maps[value.parent].subject if isinstance(value, Join) else value
            for value in item.objects
            if not (isinstance(value, Join) and value.conditions)
        ]
        if objects:
            properties.append(_property(select, triples_map, item, select.makers(objects)))
    return _statement(select, triples_map, properties)


def _property(
    select: _Select, triples_map: TriplesMap, item: PredicateObjectMap, objects: tuple[TermMaker, ...]
) -> PlannedProperty:
    graphs = select.graphs([*triples_map.graphs, *item.graphs]) if item.graphs else None
    return PlannedProperty(select.makers(item.predicates), objects, graphs)


def _statement(select: _Select, triples_map: TriplesMap, properties: Sequence[PlannedProperty]) -> Statement:
    subject, graphs = select.maker(triples_map.subject), select.graphs(triples_map.graphs)
    return Statement(
        where=triples_map.where,
        sql=select.sql,
        table=triples_map.table.table if len(select.sources) == 1 else (),
        columns=tuple(name for _, name in select.chosen),
        subject=subject,
        graphs=graphs,
        properties=tuple(properties),
    )


def _constant(name: NamedNode) -> TermMap:
    return TermMap("", TermType.IRI, constant=name)
