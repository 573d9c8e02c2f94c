"""A change of the graph read as facts: what a row is to say, what stands for itself, and what nobody can assert."""

from __future__ import annotations

import math
import secrets
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field
from datetime import UTC, datetime
from functools import partial
from typing import Any

from pyoxigraph import BlankNode, Literal, NamedNode, Quad, Store, Triple
from sqlalchemy import Column, Engine, Float, select
from sqlalchemy.orm import Session

from irtwin.errors import InputError
from irtwin.knowledge.asserted import terms
from irtwin.knowledge.asserted.terms import refusal
from irtwin.knowledge.explain.mapping import maps_of, says
from irtwin.knowledge.mapping import RowMapper
from irtwin.knowledge.mapping.document import TermMap
from irtwin.knowledge.mapping.terms import values_in
from irtwin.knowledge.owl_rl.closure import say
from irtwin.knowledge.store import ontology
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import (
    GRAPH,
    GRAPH_ACTIVITY,
    GRAPH_ASSERTED,
    GRAPH_INFERRED,
    GRAPH_ONTOLOGY,
    GRAPH_SOURCE,
    TYPE,
    XSD,
)
from irtwin.storage.asserted import FILLED, AssertedFact, key_text, row_of, value_of, written
from irtwin.storage.row_rules import check_row
from irtwin.storage.rows import values
from irtwin.storage.schema import Base, RobotRow
from irtwin.storage.tariff import FILE

Property = tuple[NamedNode, NamedNode]  # a subject, and what is said of it

_ONTOLOGY = NamedNode(GRAPH_ONTOLOGY)
_NUMBER: Column[Any] = Column("number", Float)
_NUMBERS = frozenset(f"{XSD}{name}" for name in ("double", "float", "decimal", "integer", "int", "long"))
_NEEDS_VALUE = "needs a value; say another one in the same update"
_MADE_BY = {
    GRAPH_ACTIVITY: "a provider worked it out; change what it worked on",
    GRAPH_INFERRED: "it is concluded; change what it is concluded from",
    GRAPH_SOURCE: "it was taken in with a data set; change it there",
    GRAPH_ONTOLOGY: "it stands in the ontology; put a module of your own into the workspace's ontology/",
}


@dataclass
class Assertion:
    """Facts to keep, ids of those that are taken back, and what the graph will lose and get by both."""

    facts: list[AssertedFact] = field(default_factory=list)
    withdrawn: list[str] = field(default_factory=list)
    removed: set[Quad] = field(default_factory=set)
    added: set[Quad] = field(default_factory=set)


@dataclass(frozen=True)
class _Cell:
    """A column that a user may fill, of the row that a subject is; `graph` and `datatype` of what it is mapped to."""

    column: Column[Any]
    key: dict[str, str]
    graph: NamedNode
    datatype: NamedNode | None


def read(
    graph: KnowledgeGraph, session: Session, removed: Iterable[Quad], added: Iterable[Quad], author: str
) -> Assertion:
    """Read what a user takes out of named graphs and puts into them as one assertion.

    Raises InputError, which says why, where a statement is nobody's to assert or to take back.
    """
    reading = _Reading(graph, session, author)
    taken, given = _by_property(removed), _by_property(added)
    for about in sorted(taken.keys() | given.keys(), key=str):
        reading.take(about, taken.get(about, set()), given.get(about, set()))
    return reading.assertion


def quad_of(fact: AssertedFact) -> Quad:
    """Return the quad of a fact that no row follows."""
    value = str(fact.value)
    if fact.kind == "IRI":
        term: NamedNode | Literal = NamedNode(value)
    elif fact.kind.startswith("@"):
        term = Literal(value, language=fact.kind[1:])
    else:
        term = Literal(value, datatype=NamedNode(fact.kind))
    return Quad(NamedNode(fact.subject), NamedNode(fact.predicate), term, NamedNode(fact.graph))


def individuals(graph: KnowledgeGraph, engine: Engine, facts: Iterable[AssertedFact]) -> set[Quad]:
    """Return what is mapped of facts themselves: who said what, and when."""
    mapper = RowMapper(engine, graph.resources.paths("mappings"), graph.base)
    rows = (values(fact) | {"time": fact.time.replace(tzinfo=None)} for fact in facts)
    return set(mapper.quads(AssertedFact.__tablename__, rows))


def map_facts(graph: KnowledgeGraph, session: Session) -> None:
    """Bring the statements that no row follows into the graph: those that are kept, and no other.

    What is said of a limit stands in the ontology's graph in place of what its module says.
    """
    free = select(AssertedFact).where(AssertedFact.place.is_(None)).order_by(AssertedFact.time)
    facts = list(session.scalars(free))
    kept = Store()  # which gives literals back as the graph does
    kept.extend(quad_of(fact) for fact in facts if fact.graph != GRAPH_ONTOLOGY)
    names = {GRAPH_ASSERTED, *(quad.graph_name.value for quad in kept)}
    there = {quad for name in names for quad in graph.store.quads_in(name)}
    if graph.has_ontology:
        limits = _limits(graph, facts)
        of_limits = (Quad(*row) for row in graph.store.said_of({limit for limit, _ in limits}))
        there |= {
            quad for quad in of_limits if (quad.subject, quad.predicate) in limits and quad.graph_name == _ONTOLOGY
        }
        kept.extend(limits.values())
    graph.change(there - set(kept), set(kept) - there)


def _limits(graph: KnowledgeGraph, facts: Iterable[AssertedFact]) -> dict[Property, Quad]:
    """Return value and source of each limit: by the last fact about it, else by its module."""
    limits = ontology.limits(graph.resources)
    for fact in facts:
        limit = NamedNode(fact.subject)
        if fact.graph == GRAPH_ONTOLOGY and (limit, ontology.LIMIT_VALUE) in limits:
            limits[limit, ontology.LIMIT_VALUE] = quad_of(fact)
            limits[limit, ontology.SOURCE] = _source_of(fact)
    return limits


def _source_of(fact: AssertedFact) -> Quad:
    """Return what the source of a limit is by a fact about it."""
    said_by = Literal(f"{fact.author}, {fact.time:%Y-%m-%d}, in place of {fact.replaced}")
    return Quad(NamedNode(fact.subject), ontology.SOURCE, said_by, _ONTOLOGY)


def _by_property(quads: Iterable[Quad]) -> dict[Property, set[Quad]]:
    by_property: dict[Property, set[Quad]] = {}
    for quad in quads:
        if any(isinstance(term, BlankNode | Triple) for term in (quad.subject, quad.object)):
            raise InputError("statements with blank nodes cannot be asserted or taken out: give each an IRI")
        by_property.setdefault((quad.subject, quad.predicate), set()).add(quad)  # type: ignore[arg-type]
    return by_property


def _cell(graph: KnowledgeGraph, subject: NamedNode, predicate: NamedNode) -> _Cell | None:
    for _, triples_map in maps_of(graph.resources.of("mappings")):
        table = triples_map.table.table[-1].name if triples_map.table.table else ""
        key = values_in(subject.value, triples_map.subject.template, graph.base) if table in FILLED else None
        for pair in triples_map.properties if key is not None else ():
            column = pair.objects[0].column if isinstance(pair.objects[0], TermMap) else None
            if column is None or column.name not in FILLED[table] or pair.predicates[0].constant != predicate:
                continue
            constant = triples_map.graphs[0].constant
            assert isinstance(constant, NamedNode) and isinstance(pair.objects[0], TermMap) and key is not None
            of_column = Base.metadata.tables[table].columns[column.name]
            return _Cell(of_column, key, constant, pair.objects[0].datatype)
    return None


class _Reading:
    """A change on its way to an assertion: the graph and the rows that it is of, and who makes it."""

    def __init__(self, graph: KnowledgeGraph, session: Session, author: str) -> None:
        self.assertion = Assertion()
        self._graph, self._session = graph, session
        self._made = {"author": author, "time": datetime.now(UTC)}

    def take(self, about: Property, gone: set[Quad], new: set[Quad]) -> None:
        """Read what goes and comes of one property of a subject."""
        subject, predicate = about
        common = {"subject": subject.value, "predicate": predicate.value, **self._made}
        fact = partial(AssertedFact, about_robot=self._robot(subject), **common)
        if cell := _cell(self._graph, subject, predicate):
            self._fill(cell, about, new, fact)
        elif predicate == ontology.LIMIT_VALUE and about in ontology.limits(self._graph.resources):
            self._set_limit(about, new, fact)
        else:
            if subject == ontology.ELECTRICITY:
                self._check_tariff(about)
            for quad in gone:
                self._withdraw(quad)
            for quad in new:
                self._check_free(quad)
                self.assertion.facts.append(fact(fact_id=secrets.token_hex(12), **_free(quad)))
                self.assertion.added.add(quad)

    def _robot(self, subject: NamedNode) -> str | None:
        """Return the robot that an individual's IRI is about, if any."""
        base = self._graph.base
        parts = subject.value.removeprefix(base).split("/")
        robot_id = parts[1].partition(".")[0] if len(parts) > 1 and subject.value.startswith(base) else ""
        return robot_id if robot_id and self._session.get(RobotRow, robot_id) is not None else None

    def _fill(self, cell: _Cell, about: Property, new: set[Quad], make_fact: Callable[..., AssertedFact]) -> None:
        """Read what a row is to say in place of what it says."""
        statement = say(about, self._graph.base)
        fact = make_fact(
            fact_id=secrets.token_hex(12),
            value=_text(cell.column, new, statement),
            kind=f"{XSD}string" if cell.datatype is None else cell.datatype.value,
            graph=cell.graph.value,
            place=f"{cell.column.table.name}.{cell.column.name}",
            row_key=key_text(cell.key),
        )
        row = row_of(self._session, fact)
        if row is None:
            raise refusal(statement, f"the database has no such {cell.column.table.name}")
        if fact.value is None and not cell.column.nullable:
            raise refusal(statement, _NEEDS_VALUE)
        try:
            check_row(fact.table, values(row) | {cell.column.name: value_of(cell.column, fact.value)})
        except ValueError as error:
            raise refusal(statement, error) from None
        fact.replaced = written(getattr(row, cell.column.name))
        if fact.value != fact.replaced:
            self.assertion.facts.append(fact)
            self.assertion.removed |= self._said(about, cell.graph)
            self.assertion.added |= set() if fact.value is None else {quad_of(fact)}

    def _set_limit(self, about: Property, new: set[Quad], make_fact: Callable[..., AssertedFact]) -> None:
        """Read what a limit is to be: in place of what its module says, or that again, which takes back what was said.

        Its source goes along, so that what is tried is the ontology that will hold.
        """
        limits, source = ontology.limits(self._graph.resources), (about[0], ontology.SOURCE)
        statement, shipped = say(about, self._graph.base), limits[about]
        value = _text(_NUMBER, new, statement)
        if value is not None and not math.isfinite(float(value)):
            raise refusal(statement, f"cannot be {value}")
        of_limit = select(AssertedFact.fact_id).where(AssertedFact.subject == about[0].value)
        known = self._session.scalars(of_limit.where(AssertedFact.graph == GRAPH_ONTOLOGY)).all()
        if value is None and not known:
            raise refusal(statement, _NEEDS_VALUE)
        now = next(iter(self._said(about, _ONTOLOGY)), shipped)
        before, old = _float(now), {now, *self._said(source, _ONTOLOGY)}
        if value is None or float(value) == _float(shipped):
            self.assertion.withdrawn += known
            self._exchange(old, {limits[key] for key in (about, source) if key in limits})
        elif float(value) != before:
            more = {"value": value, "kind": f"{XSD}double", "graph": GRAPH_ONTOLOGY, "replaced": written(before)}
            fact = make_fact(fact_id=secrets.token_hex(12), **more)
            self.assertion.facts.append(fact)
            self._exchange(old, {quad_of(fact), _source_of(fact)})

    def _exchange(self, old: set[Quad], new: set[Quad]) -> None:
        self.assertion.removed |= old - new
        self.assertion.added |= new - old

    def _said(self, about: Property, graph: NamedNode) -> set[Quad]:
        """Return what one named graph says of a property."""
        return {quad for quad in self._graph.store.said(*about) if quad.graph_name == graph}

    def _check_tariff(self, about: Property) -> None:
        """Raise InputError where `plant.toml` says a property of the tariff: the ontology's graph does, no module."""
        modules = ontology.of_modules(self._graph.resources)
        if self._said(about, _ONTOLOGY) and not any((quad.subject, quad.predicate) == about for quad in modules):
            raise refusal(say(about, self._graph.base), f"stands in the workspace's {FILE}; change it there")

    def _withdraw(self, quad: Quad) -> None:
        about = select(AssertedFact).where(AssertedFact.subject == getattr(quad.subject, "value", ""))
        free = self._session.scalars(about.where(AssertedFact.place.is_(None)))
        ids = [fact.fact_id for fact in free if quad_of(fact) == quad]
        name = getattr(quad.graph_name, "value", "")
        if not ids and name.startswith(GRAPH):
            reasons = (reason for below, reason in _MADE_BY.items() if name.startswith(below))
            why = next(reasons, "irtwin says it of itself")
            raise refusal(say(quad.triple, self._graph.base), f"cannot be taken out: {why}")
        self.assertion.withdrawn += ids
        self.assertion.removed.add(quad)

    def _check_free(self, quad: Quad) -> None:
        """Raise InputError where a statement is one that irtwin makes itself."""
        resources, base = self._graph.resources, self._graph.base
        statement, name = say(quad.triple, base), getattr(quad.graph_name, "value", "")
        if name.startswith(GRAPH) and name != GRAPH_ASSERTED:
            raise refusal(statement, f"graph <{name}> is irtwin's own; leave GRAPH out")
        terms.check(resources, quad, statement)
        if quad.predicate != TYPE and says(quad.triple, resources.of("mappings"), base) is not None:
            raise refusal(statement, "cannot be asserted: irtwin takes it from logs and files, or works it out")


def _float(quad: Quad) -> float:
    return float(quad.object.value)  # type: ignore[union-attr]


def _text(column: Column[Any], new: set[Quad], statement: str) -> str | None:
    """Return the one value that is new as facts write it, in the column's own form; None without any.

    InputError where there are several, or the column can hold no such.
    """
    values = {quad.object for quad in new}
    if len(values) > 1:
        raise refusal(statement, f"has one value, not {len(values)}")
    if not values:
        return None
    (value,) = values
    is_number = column.type.python_type is not str
    datatype = value.datatype.value if isinstance(value, Literal) else ""
    if not isinstance(value, Literal) or (datatype not in _NUMBERS if is_number else datatype != f"{XSD}string"):
        raise refusal(statement, f"is a {'number' if is_number else 'text'}, not {value}")
    try:
        return written(value_of(column, value.value))
    except ValueError:
        raise refusal(statement, f"cannot be {value.value!r}") from None


def _free(quad: Quad) -> dict[str, str]:
    """Return the columns of a fact that no row follows."""
    term = quad.object
    of_literal = isinstance(term, Literal) and (f"@{term.language}" if term.language else term.datatype.value)
    return {"value": term.value, "kind": of_literal or "IRI", "graph": quad.graph_name.value}  # type: ignore[union-attr]
