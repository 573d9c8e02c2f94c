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

_ONTOLOGY = NamedNode(GRAPH_ONTOLOGY)
_NUMBER: Column[Any] = Column("number", Float)
_NUMBERS = frozenset(f"{XSD}{name}" for name in ("double", "float", "decimal", "integer", "int", "long"))
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
    assertion = Assertion()
    taken, given = _by_property(removed), _by_property(added)
    now = datetime.now(UTC)
    for subject, predicate in sorted(taken.keys() | given.keys(), key=str):
        gone, new = taken.get((subject, predicate), set()), given.get((subject, predicate), set())
        common = {"subject": subject.value, "predicate": predicate.value, "author": author, "time": now}
        fact = partial(AssertedFact, about_robot=_robot(graph, session, subject), **common)
        cell = _cell(graph, subject, predicate)
        if cell is not None:
            _fill(assertion, graph, session, cell, (subject, predicate), new, fact)
            continue
        if predicate == ontology.LIMIT_VALUE and (subject, predicate) in ontology.limits(graph.resources):
            _set_limit(assertion, graph, session, (subject, predicate), new, fact)
            continue
        if subject == ontology.ELECTRICITY:
            _check_tariff(graph, predicate)
        for quad in gone:
            _withdraw(assertion, graph, session, quad)
        for quad in new:
            _check_free(graph, quad)
            assertion.facts.append(fact(fact_id=secrets.token_hex(12), **_free(quad)))
            assertion.added.add(quad)
    return assertion


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


def _limits(graph: KnowledgeGraph, facts: Iterable[AssertedFact]) -> dict[tuple[NamedNode, NamedNode], Quad]:
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


def _by_property(quads: Iterable[Quad]) -> dict[tuple[NamedNode, NamedNode], set[Quad]]:
    by_property: dict[tuple[NamedNode, NamedNode], set[Quad]] = {}
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


def _fill(
    assertion: Assertion,
    graph: KnowledgeGraph,
    session: Session,
    cell: _Cell,
    about: tuple[NamedNode, NamedNode],
    new: set[Quad],
    make_fact: Callable[..., AssertedFact],
) -> None:
    """Read what a row is to say in place of what it says."""
    statement = say(about, graph.base)
    fact = make_fact(
        fact_id=secrets.token_hex(12),
        value=_text(cell.column, new, statement),
        kind=f"{XSD}string" if cell.datatype is None else cell.datatype.value,
        graph=cell.graph.value,
        place=f"{cell.column.table.name}.{cell.column.name}",
        row_key=key_text(cell.key),
    )
    row = row_of(session, fact)
    if row is None:
        raise InputError(f"{statement}: the database has no such {cell.column.table.name}; nothing changed")
    if fact.value is None and not cell.column.nullable:
        raise InputError(f"{statement}: needs a value; say another one in the same update; nothing changed")
    try:
        check_row(fact.table, values(row) | {cell.column.name: value_of(cell.column, fact.value)})
    except ValueError as error:
        raise InputError(f"{statement}: {error}; nothing changed") from None
    fact.replaced = written(getattr(row, cell.column.name))
    if fact.value == fact.replaced:
        return
    assertion.facts.append(fact)
    assertion.removed |= {quad for quad in graph.store.said(*about) if quad.graph_name == cell.graph}
    if fact.value is not None:
        assertion.added.add(quad_of(fact))


def _set_limit(
    assertion: Assertion,
    graph: KnowledgeGraph,
    session: Session,
    about: tuple[NamedNode, NamedNode],
    new: set[Quad],
    make_fact: Callable[..., AssertedFact],
) -> None:
    """Read what a limit is to be: in place of what its module says, or that again, which takes back what was said.

    Its source goes along, so that what is tried is the ontology that will hold.
    """
    limits = ontology.limits(graph.resources)
    statement, shipped = say(about, graph.base), limits[about]
    value = _text(_NUMBER, new, statement)
    if value is not None and not math.isfinite(float(value)):
        raise InputError(f"{statement}: cannot be {value}; nothing changed")
    of_limit = select(AssertedFact.fact_id).where(AssertedFact.subject == about[0].value)
    known = session.scalars(of_limit.where(AssertedFact.graph == GRAPH_ONTOLOGY)).all()
    if value is None and not known:
        raise InputError(f"{statement}: needs a value; say another one in the same update; nothing changed")
    now = next((quad for quad in graph.store.said(*about) if quad.graph_name == _ONTOLOGY), shipped)
    before = _float(now)
    sources = {quad for quad in graph.store.said(about[0], ontology.SOURCE) if quad.graph_name == _ONTOLOGY}
    if value is None or float(value) == _float(shipped):
        assertion.withdrawn += known
        _exchange(
            assertion, {now, *sources}, {limits[key] for key in (about, (about[0], ontology.SOURCE)) if key in limits}
        )
        return
    more = {"value": value, "kind": f"{XSD}double", "graph": GRAPH_ONTOLOGY, "replaced": written(before)}
    fact = make_fact(fact_id=secrets.token_hex(12), **more)
    if float(value) != before:
        assertion.facts.append(fact)
        _exchange(assertion, {now, *sources}, {quad_of(fact), _source_of(fact)})


def _exchange(assertion: Assertion, old: set[Quad], new: set[Quad]) -> None:
    assertion.removed |= old - new
    assertion.added |= new - old


def _float(quad: Quad) -> float:
    return float(quad.object.value)  # type: ignore[union-attr]


def _text(column: Column[Any], new: set[Quad], statement: str) -> str | None:
    """Return the one value that is new as facts write it, in the column's own form; None without any.

    InputError where there are several, or the column can hold no such.
    """
    values = {quad.object for quad in new}
    if len(values) > 1:
        raise InputError(f"{statement}: has one value, not {len(values)}; nothing changed")
    if not values:
        return None
    (value,) = values
    is_number = column.type.python_type is not str
    datatype = value.datatype.value if isinstance(value, Literal) else ""
    if not isinstance(value, Literal) or (datatype not in _NUMBERS if is_number else datatype != f"{XSD}string"):
        raise InputError(f"{statement}: is a {'number' if is_number else 'text'}, not {value}; nothing changed")
    try:
        return written(value_of(column, value.value))
    except ValueError:
        raise InputError(f"{statement}: cannot be {value.value!r}; nothing changed") from None


def _robot(graph: KnowledgeGraph, session: Session, subject: NamedNode) -> str | None:
    """Return the robot that an individual's IRI is about, if any."""
    parts = subject.value.removeprefix(graph.base).split("/")
    robot_id = parts[1].partition(".")[0] if len(parts) > 1 and subject.value.startswith(graph.base) else ""
    return robot_id if robot_id and session.get(RobotRow, robot_id) is not None else None


def _check_tariff(graph: KnowledgeGraph, predicate: NamedNode) -> None:
    """Raise InputError where `plant.toml` says a property of the tariff: the ontology's graph does, and no module."""
    quads = {quad for quad in graph.store.said(ontology.ELECTRICITY, predicate) if quad.graph_name == _ONTOLOGY}
    modules = ontology.of_modules(graph.resources)
    if quads and not any(quad.subject == ontology.ELECTRICITY and quad.predicate == predicate for quad in modules):
        statement = say((ontology.ELECTRICITY, predicate), graph.base)
        raise InputError(f"{statement}: stands in the workspace's {FILE}; change it there; nothing changed")


def _withdraw(assertion: Assertion, graph: KnowledgeGraph, session: Session, quad: Quad) -> None:
    about = select(AssertedFact).where(AssertedFact.subject == getattr(quad.subject, "value", ""))
    free = session.scalars(about.where(AssertedFact.place.is_(None)))
    ids = [fact.fact_id for fact in free if quad_of(fact) == quad]
    name = getattr(quad.graph_name, "value", "")
    if not ids and name.startswith(GRAPH):
        why = next((reason for below, reason in _MADE_BY.items() if name.startswith(below)), "irtwin says it of itself")
        raise InputError(f"{say(quad.triple, graph.base)}: cannot be taken out: {why}; nothing changed")
    assertion.withdrawn += ids
    assertion.removed.add(quad)


def _check_free(graph: KnowledgeGraph, quad: Quad) -> None:
    """Raise InputError where a statement is one that irtwin makes itself."""
    statement, name = say(quad.triple, graph.base), getattr(quad.graph_name, "value", "")
    if name.startswith(GRAPH) and name != GRAPH_ASSERTED:
        raise InputError(f"{statement}: graph <{name}> is irtwin's own; leave GRAPH out; nothing changed")
    terms.check(graph.resources, quad, statement)
    if quad.predicate != TYPE and says(quad.triple, graph.resources.of("mappings"), graph.base) is not None:
        raise InputError(
            f"{statement}: cannot be asserted: irtwin takes it from logs and files, or works it out; nothing changed"
        )


def _free(quad: Quad) -> dict[str, str]:
    """Return the columns of a fact that no row follows."""
    term = quad.object
    of_literal = isinstance(term, Literal) and (f"@{term.language}" if term.language else term.datatype.value)
    return {"value": term.value, "kind": of_literal or "IRI", "graph": quad.graph_name.value}  # type: ignore[union-attr]
