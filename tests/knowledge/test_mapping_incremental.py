"""Mapping only what changed leaves the graph that a full run makes."""

from __future__ import annotations

import sqlite3
import tempfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyoxigraph import NamedNode, Quad, Triple
from sqlalchemy import Engine
from tests import small_fleet
from tests.knowledge.test_mapping import PREFIXES

from irtwin import rewriting
from irtwin.errors import InputError
from irtwin.knowledge.mapping import map_database, refresh
from irtwin.knowledge.mapping.remembered import RememberedRows
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE, TYPE
from irtwin.storage.database import Workspace
from irtwin.storage.engine import open_engine
from irtwin.storage.staging import staged

TABLES = """
CREATE TABLE city (id INTEGER PRIMARY KEY, name VARCHAR, area NUMERIC(8, 2));
CREATE TABLE person (id INTEGER PRIMARY KEY, name VARCHAR, city INTEGER, since DATE, part VARCHAR);
"""
# Names are shared by several rows and two triples maps; graphs and joins come and go with a column.
MAPPING = (
    PREFIXES
    + """
@prefix g: <https://w3id.org/irtwin/graph/source/> .
<#City> rr:logicalTable [ rr:tableName "city" ] ;
    rr:subjectMap [ rr:template "http://example.com/city/{id}" ; rr:class ex:City ; rr:graph g:city ] ;
    rr:predicateObjectMap [ rr:predicate ex:name ; rr:objectMap [ rr:column "name" ] ] ;
    rr:predicateObjectMap [ rr:predicate ex:area ; rr:objectMap [ rr:column "area" ] ] .
<#Person> rr:logicalTable [ rr:tableName "person" ] ;
    rr:subjectMap [ rr:template "http://example.com/person/{id}" ; rr:class ex:Person ;
        rr:graphMap [ rr:template "https://w3id.org/irtwin/graph/activity/{part}" ] ] ;
    rr:predicateObjectMap [ rr:predicate ex:name ; rr:objectMap [ rr:column "name" ] ; rr:graph g:person ] ;
    rr:predicateObjectMap [ rr:predicate ex:since ; rr:objectMap [ rr:column "since" ] ] ;
    rr:predicateObjectMap [ rr:predicate ex:city ; rr:objectMap [ rr:parentTriplesMap <#City> ;
        rr:joinCondition [ rr:child "city" ; rr:parent "id" ] ] ] .
<#Name> rr:logicalTable [ rr:sqlQuery "SELECT name FROM person UNION ALL SELECT name FROM city" ] ;
    rr:subjectMap [ rr:template "http://example.com/name/{name}" ; rr:class ex:Name ; rr:graph g:city ] .
<#Inhabited> rr:logicalTable [ rr:tableName "person" ] ;
    rr:subjectMap [ rr:template "http://example.com/city/{city}" ; rr:class ex:City ; rr:graph g:city ] ;
    rr:predicateObjectMap [ rr:predicate ex:inhabitant ; rr:objectMap [ rr:column "name" ] ] .
"""
)

names = st.sampled_from(["Ada", "Bo & Co", "é", None])
persons = st.tuples(
    st.integers(0, 4),
    names,
    st.none() | st.integers(0, 3),
    st.sampled_from([None, "2026-01-02", "2025-12-31"]),
    st.sampled_from([None, "a", "b"]),
)
cities = st.tuples(st.integers(0, 3), names, st.none() | st.sampled_from([1, 2.5, 0.1]))
statements = st.one_of(
    st.tuples(st.just("INSERT OR REPLACE INTO person VALUES (?, ?, ?, ?, ?)"), persons),
    st.tuples(st.just("INSERT OR REPLACE INTO city VALUES (?, ?, ?)"), cities),
    st.tuples(st.just("DELETE FROM person WHERE id = ?"), st.tuples(st.integers(0, 4))),
    st.tuples(st.just("DELETE FROM city WHERE id = ?"), st.tuples(st.integers(0, 3))),
    st.tuples(st.just("UPDATE person SET city = ?"), st.tuples(st.integers(0, 3))),
)
SQL = tuple[str, Sequence[object]]
ENDLESS_VIEW = """ALTER TABLE entries RENAME TO other; CREATE VIEW entries AS
WITH RECURSIVE c(a) AS (SELECT 1 UNION ALL SELECT a + 1 FROM c) SELECT other.* FROM other, c"""


class Place:
    """A database, its mapping, a graph and the file of remembered rows."""

    def __init__(self, folder: Path) -> None:
        self.database, self.document, self.file = folder / "a.db", folder / "a.r2rml.ttl", folder / "rows.db"
        self.graph = KnowledgeGraph()
        self.document.write_text(MAPPING)
        self.run(*((line, ()) for line in TABLES.strip().split("\n")))
        self.engine: Engine = open_engine(f"sqlite:///{self.database}")

    def run(self, *statements: SQL) -> None:
        with sqlite3.connect(self.database) as connection:
            for sql, values in statements:
                connection.execute(sql, values)

    def alter_file(self, script: str) -> None:
        with sqlite3.connect(self.file) as connection:
            connection.executescript(script)

    def refresh(self) -> None:
        refresh(self.graph, self.engine, [self.document], self.file)

    def check(self) -> None:
        """The graph is what a full run makes, named graphs and their union, but for the version's mark."""
        made = set(map_database(self.engine, [self.document]))
        names = {quad.graph_name.value for quad in made if isinstance(quad.graph_name, NamedNode)}
        mark = f"{GRAPH_SOURCE}version"
        assert set(self.graph.graphs(GRAPH_SOURCE, GRAPH_ACTIVITY)) - {mark} >= names
        for name in self.graph.graphs():
            if name != mark:
                assert self.graph.triples(name) == {q.triple for q in made if q.graph_name == NamedNode(name)}
        assert self.graph.triples() - self.graph.triples(mark) == {quad.triple for quad in made}


@pytest.fixture
def place(tmp_path: Path) -> Place:
    place = Place(tmp_path)
    place.run(
        ("INSERT INTO city VALUES (1, 'Ada', 2.5), (2, 'Rom', NULL)", ()),
        ("INSERT INTO person VALUES (1, 'Ada', 1, '2026-01-02', 'a'), (2, 'Ada', 2, NULL, 'b')", ()),
    )
    place.refresh()
    return place


@pytest.fixture
def full_runs(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """A list that grows by each full run."""
    counted: list[int] = []
    forget = RememberedRows.forget

    def counting(rows: RememberedRows) -> None:
        counted.append(1)
        forget(rows)

    monkeypatch.setattr(RememberedRows, "forget", counting)
    return counted


@pytest.mark.slow
@given(runs=st.lists(st.lists(statements, max_size=8), max_size=6))
@settings(max_examples=30)
def test_the_graph_is_a_full_runs(runs: list[list[SQL]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        place = Place(Path(folder))
        for run in runs:
            place.run(*run)
            place.refresh()
            place.check()
        place.engine.dispose()


def test_only_what_changed_is_touched(place: Place, full_runs: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    changed: list[set[str]] = []
    change = KnowledgeGraph.change

    def watching(graph: KnowledgeGraph, removed: Iterable[Quad], added: Iterable[Quad]) -> None:
        changed.extend(
            {str(quad.triple) for quad in quads if "versionInfo" not in str(quad)} for quads in (removed, added)
        )
        change(graph, removed, added)

    monkeypatch.setattr(KnowledgeGraph, "change", watching)
    place.refresh()
    assert changed == []
    place.run(("UPDATE city SET name = 'Roma' WHERE id = 2", ()))
    place.refresh()
    name, kind = "<http://example.com/name>", f"{TYPE} <http://example.com/Name>"
    assert changed == [
        {f'<http://example.com/city/2> {name} "Rom"', f"<http://example.com/name/Rom> {kind}"},
        {f'<http://example.com/city/2> {name} "Roma"', f"<http://example.com/name/Roma> {kind}"},
    ]
    place.check()
    assert full_runs == []


def test_a_row_that_others_stand_in_for_takes_nothing_with_it(place: Place) -> None:
    place.run(("DELETE FROM person WHERE id = 1", ()))  # Ada is still the name of a city and of another person
    place.refresh()
    place.check()
    ada = Triple(NamedNode("http://example.com/name/Ada"), TYPE, NamedNode("http://example.com/Name"))
    assert place.graph.holds(ada)


HAPPENS: dict[str, Callable[[Place], object]] = {
    "another document": lambda place: place.document.write_text(MAPPING.replace("ex:since", "ex:from")),
    "another table": lambda place: place.run(("ALTER TABLE person ADD COLUMN more INTEGER", ())),
    "no file": lambda place: place.file.unlink(),
    "a broken file": lambda place: place.file.write_bytes(b"no database at all" * 100),
    "another graph": lambda place: setattr(place, "graph", KnowledgeGraph()),
    "a graph of another time": lambda place: place.graph.replace([], f"{GRAPH_SOURCE}version"),
    "an older file": lambda place: place.alter_file("PRAGMA user_version = 0"),
    "a view that never ends": lambda place: place.alter_file(ENDLESS_VIEW),
    "a trigger": lambda place: place.alter_file(
        "CREATE TRIGGER t AFTER INSERT ON kept_row BEGIN DELETE FROM kept_row; END"
    ),
}


@pytest.mark.parametrize("what", HAPPENS)
def test_all_is_mapped_where_the_rows_are_not_the_graphs(place: Place, what: str, full_runs: list[int]) -> None:
    HAPPENS[what](place)
    full_runs.clear()
    for change in ("UPDATE person SET city = 2, name = 'é'", "DELETE FROM person WHERE id = 2"):
        place.run((change, ()))
        place.refresh()
        place.check()
        assert full_runs == [1]


def test_a_crash_between_graph_and_file(place: Place, full_runs: list[int], monkeypatch: pytest.MonkeyPatch) -> None:
    change = KnowledgeGraph.change

    def crashing(graph: KnowledgeGraph, removed: Iterable[Quad], added: Iterable[Quad]) -> None:
        change(graph, removed, added)
        raise KeyboardInterrupt

    monkeypatch.setattr(KnowledgeGraph, "change", crashing)
    place.run(("UPDATE person SET name = 'é' WHERE id = 1", ()))
    with pytest.raises(KeyboardInterrupt):
        place.refresh()
    monkeypatch.undo()
    place.run(("UPDATE person SET name = 'Bo & Co' WHERE id = 1", ()))
    place.refresh()
    place.check()


def test_a_row_that_does_not_fit_leaves_all_as_it_was(place: Place) -> None:
    place.document.write_text(
        MAPPING.replace('rr:column "name" ] ; rr:graph', 'rr:column "name" ; rr:datatype xsd:date ] ; rr:graph')
    )
    place.run(("UPDATE person SET name = NULL", ()))
    place.refresh()
    before = place.graph.triples(), place.file.read_bytes()
    place.run(("UPDATE person SET name = 'today'", ()))
    with pytest.raises(InputError, match="the value 'today' is no"):
        place.refresh()
    assert (place.graph.triples(), place.file.read_bytes()) == before
    place.run(("UPDATE person SET name = '2026-01-02'", ()))
    place.refresh()
    place.check()


def test_blank_nodes_are_made_anew(place: Place, full_runs: list[int]) -> None:
    place.document.write_text(
        MAPPING.replace('"http://example.com/name/{name}"', '"{name}" ; rr:termType rr:BlankNode')
    )
    for name in ("é", "Ada", "Bo & Co"):
        place.run(("UPDATE person SET name = ? WHERE id = 1", (name,)))
        place.refresh()
        made = set(map_database(place.engine, [place.document]))
        assert len(place.graph.triples(f"{GRAPH_SOURCE}city")) == len(
            {quad.triple for quad in made if quad.graph_name == NamedNode(f"{GRAPH_SOURCE}city")}
        )
    assert len(full_runs) == 3


def test_where_rows_cannot_be_remembered(place: Place, tmp_path: Path) -> None:
    place.file = tmp_path / "none" / "rows.db"
    with pytest.raises(InputError, match=r"rows\.db: cannot be written: unable to open"):
        place.refresh()


@pytest.fixture
def fleet(database_url: str | None, tmp_path: Path) -> Iterator[Workspace]:
    with Workspace(tmp_path / "fleet", database_url) as place:
        small_fleet.fill(place)
        yield place


@pytest.mark.slow
def test_a_workspace_is_followed(fleet: Workspace) -> None:
    documents = [file.path for file in fleet.resources.of("mappings")]
    with KnowledgeGraph() as graph:
        rewriting.map_rows(fleet, graph)

        def follow() -> None:
            rewriting.map_rows(fleet, graph)
            made = KnowledgeGraph()
            made.replace(map_database(fleet.engine, documents), GRAPH_SOURCE, GRAPH_ACTIVITY)
            for name in {*made.graphs(GRAPH_SOURCE, GRAPH_ACTIVITY), *graph.graphs(GRAPH_SOURCE, GRAPH_ACTIVITY)}:
                assert name == f"{GRAPH_SOURCE}version" or graph.triples(name) == made.triples(name)

        with fleet.engine.begin() as connection:
            connection.exec_driver_sql("UPDATE run_energy SET peak_power_w = 1 WHERE run_id = 'Arm_A.fit_1'")
        follow()
        with staged(fleet, "Arm_C") as apart, apart.engine.begin() as connection:
            connection.exec_driver_sql("DELETE FROM run_energy")
        follow()
        fleet.drop_robot("Arm_B")
        follow()
