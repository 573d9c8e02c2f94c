"""A database that notes what changes is mapped by those notes, and wholly where they cannot be all."""

from __future__ import annotations

import shutil
import sqlite3
import tempfile
from collections.abc import Callable, Iterator
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sqlalchemy import Engine
from tests import small_fleet
from tests.knowledge.test_mapping import PREFIXES

from irtwin import workflow
from irtwin.knowledge.mapping import incremental, map_database, refresh
from irtwin.knowledge.mapping.document import LogicalTable
from irtwin.knowledge.mapping.processor import planned
from irtwin.knowledge.mapping.remembered import RememberedRows
from irtwin.knowledge.mapping.tables_read import table_of
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.storage.database import Workspace
from irtwin.storage.engine import open_engine
from irtwin.storage.row_changes import TABLE, keep_notes
from irtwin.storage.staging import staged

NOTED = ("city", "person", "visit")
TABLES = (
    "CREATE TABLE city (id INTEGER PRIMARY KEY, name VARCHAR UNIQUE)",
    "CREATE TABLE person (name VARCHAR, number INTEGER, city INTEGER REFERENCES city ON DELETE CASCADE, "
    "PRIMARY KEY (name, number))",
    "CREATE TABLE visit (person VARCHAR, city INTEGER)",  # without a key
    "CREATE TABLE stranger (id INTEGER PRIMARY KEY, name VARCHAR)",  # of somebody else, so not noted
    "CREATE VIEW living AS SELECT person.name AS name, city.name AS city FROM person JOIN city ON city = city.id",
)
TEXTS = {
    "City": '[ rr:tableName "city" ]|city/{id}|name',
    "Person": '[ rr:tableName "person" ]|person/{name}/{number}|city',
    "Placed": '[ rr:sqlQuery "SELECT * FROM person WHERE city IS NOT NULL AND number < 2" ]|at/{name}/{number}|city',
    "Visit": '[ rr:tableName "visit" ]|visit/{person}|city',
    "Stranger": '[ rr:tableName "stranger" ]|stranger/{id}|name',
    "Living": '[ rr:tableName "living" ]|person/{name}|city',
    "Total": '[ rr:sqlQuery "SELECT city, COUNT(*) AS number FROM person GROUP BY city" ]|city/{city}|number',
}
MAPPING = PREFIXES + "@prefix g: <https://w3id.org/irtwin/graph/source/> .\n"
for name, parts in TEXTS.items():
    table, template, column = parts.split("|")
    MAPPING += (
        f'<#{name}> rr:logicalTable {table} ; rr:subjectMap [ rr:template "http://example.com/{template}" ; '
        f"rr:class ex:Thing ; rr:graph g:all ] ; "
        f'rr:predicateObjectMap [ rr:predicate ex:{column} ; rr:objectMap [ rr:column "{column}" ] ] .\n'
    )
MAPPING += """<#Join> rr:logicalTable [ rr:tableName "person" ] ;
    rr:subjectMap [ rr:template "http://example.com/person/{name}" ; rr:graph g:all ] ;
    rr:predicateObjectMap [ rr:predicate ex:in ; rr:objectMap [ rr:parentTriplesMap <#City> ;
        rr:joinCondition [ rr:child "city" ; rr:parent "id" ] ] ] .
"""


class Place:
    """A database whose changes are noted, its mapping, a graph and the file of remembered rows."""

    def __init__(self, folder: Path) -> None:
        self.database, self.document, self.file = folder / "a.db", folder / "a.r2rml.ttl", folder / "rows.db"
        self.document.write_text(MAPPING)
        self.run(*TABLES)
        self.engine: Engine = open_engine(f"sqlite:///{self.database}")
        keep_notes(self.engine, NOTED)
        self.graph = KnowledgeGraph()

    def run(self, *statements: str) -> None:
        with closing(sqlite3.connect(self.database)) as connection, connection:
            connection.execute("PRAGMA foreign_keys = ON")
            for statement in statements:
                connection.execute(statement)

    def follow(self) -> None:
        """Bring the graph up to date, and see that it is what a full run makes."""
        refresh(self.graph, self.engine, [self.document], self.file)
        made = {quad.triple for quad in map_database(self.engine, [self.document])}
        assert self.graph.triples(f"{GRAPH_SOURCE}all") == made


@pytest.fixture
def place(tmp_path: Path) -> Iterator[Place]:
    place = Place(tmp_path)
    place.run(
        "INSERT INTO city VALUES (1, 'Rom'), (2, 'Oslo')",
        "INSERT INTO person VALUES ('Ada', 1, 1), ('Bo', 1, 2), ('Bo', 2, NULL)",
        "INSERT INTO visit VALUES ('Ada', 2), ('Ada', 2)",
        "INSERT INTO stranger VALUES (1, 'Eve')",
    )
    place.follow()
    yield place
    place.engine.dispose()


@pytest.fixture
def read(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """What is read of each statement: its SQL."""
    found: list[str] = []
    reading = incremental.read

    def watching(connection, sql, where):
        found.append(sql)
        return reading(connection, sql, where)

    monkeypatch.setattr(incremental, "read", watching)
    return found


numbers, names = st.integers(0, 3), st.sampled_from(["'Rom'", "'Oslo'", "'é x'", "NULL"])
statements = st.one_of(
    st.builds("INSERT OR {} INTO city VALUES ({}, {})".format, st.sampled_from(["REPLACE", "IGNORE"]), numbers, names),
    st.builds("INSERT OR REPLACE INTO person VALUES ({}, {}, NULL)".format, names, numbers),
    st.builds("INSERT OR IGNORE INTO person SELECT {}, {}, max(id) FROM city".format, names, numbers),
    st.builds("INSERT INTO visit VALUES ({}, {})".format, names, numbers),
    st.builds("INSERT INTO stranger (name) VALUES ({})".format, names),
    st.builds("UPDATE OR REPLACE city SET id = {} WHERE id = {}".format, numbers, numbers),
    st.builds("UPDATE OR REPLACE city SET name = {} WHERE id > {}".format, names, numbers),
    st.builds("UPDATE OR REPLACE person SET number = {}, name = {} WHERE number = {}".format, numbers, names, numbers),
    st.builds("UPDATE person SET city = NULL WHERE number = {}".format, numbers),
    st.builds("DELETE FROM {} WHERE city = {}".format, st.sampled_from(["visit", "person"]), numbers),
    st.builds("DELETE FROM {}".format, st.sampled_from(["visit", "person", "stranger"])),
    st.just("UPDATE visit SET city = city + 1"),
)


@given(runs=st.lists(st.lists(statements, max_size=4), min_size=1, max_size=6))
@settings(max_examples=25)
def test_whatever_is_written_the_graph_is_a_full_runs(runs: list[list[str]]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        place = Place(Path(folder))
        place.run("INSERT INTO city VALUES (1, 'Rom'), (2, 'Oslo')", "INSERT INTO person VALUES ('Ada', 1, 1)")
        place.follow()
        for run in runs:
            for statement in run:
                try:
                    place.run(statement)
                except sqlite3.IntegrityError:  # a city that people refer to
                    continue
            place.follow()
        place.engine.dispose()


def test_where_nothing_was_written_only_what_is_not_noted_is_read(place: Place, read: list[str]) -> None:
    place.follow()
    assert [sql for sql in read if "stranger" not in sql] == []


def test_only_noted_rows_are_read(place: Place, read: list[str]) -> None:
    place.run("UPDATE person SET city = 2 WHERE name = 'Ada'")
    place.follow()
    of_person = [sql for sql in read if " person child" in sql or "SELECT * FROM person" in sql]
    assert sum(TABLE in sql for sql in of_person) == 2  # the table, and the query of some of its rows
    assert not any("visit" in sql or ("city child" in sql and "person" not in sql) for sql in read)


def test_a_row_that_replace_removed_in_silence_is_missed_by_the_count(place: Place) -> None:
    place.run("INSERT OR REPLACE INTO city VALUES (3, 'Rom')")  # 1 goes, and no trigger says so
    place.follow()
    assert not any("city/1>" in str(triple.subject) for triple in place.graph.triples(f"{GRAPH_SOURCE}all"))


@pytest.mark.parametrize(
    "happens",
    [
        lambda place: place.run("DELETE FROM row_change"),
        lambda place: place.run(*["UPDATE visit SET city = city"] * 30_000),
        lambda place: place.run("DROP TRIGGER irtwin_noted_person_update"),
        lambda place: place.run("DROP TABLE person", TABLES[1], "INSERT INTO person VALUES ('Cy', 1, 1)"),
        lambda place: place.run("ALTER TABLE person RENAME TO people", "CREATE TABLE person AS SELECT * FROM people"),
    ],
    ids=["no notes", "more than are kept", "a trigger gone", "a table made anew", "a table in its place"],
)
def test_where_notes_are_not_all_everything_is_read(place: Place, happens: Callable[[Place], object]) -> None:
    happens(place)
    place.run("UPDATE person SET city = 2 WHERE name = 'Ada'")
    place.follow()
    keep_notes(place.engine, NOTED)
    place.follow()
    place.run("UPDATE person SET city = 1")
    place.follow()


def test_a_database_put_back_and_written_to(place: Place, tmp_path: Path) -> None:
    shutil.copy(place.database, tmp_path / "kept.db")
    place.run("UPDATE person SET city = 2 WHERE name = 'Ada'")
    place.follow()
    shutil.copy(tmp_path / "kept.db", place.database)
    place.engine.dispose()
    place.run("UPDATE person SET city = 1 WHERE name = 'Bo' AND number = 1")  # as many notes as before
    place.follow()


def test_two_graphs_follow_one_database(place: Place, tmp_path: Path) -> None:
    own = place.graph, place.file
    for number, (graph, file) in enumerate([(KnowledgeGraph(), tmp_path / "other.db"), own, own]):
        place.graph, place.file = graph, file
        place.run(
            f"UPDATE person SET city = NULL WHERE number = {number}", f"INSERT INTO person VALUES ('D', {number}, 1)"
        )
        place.follow()


@pytest.mark.parametrize(
    "script",
    [
        "PRAGMA user_version = 0",
        "ALTER TABLE entries RENAME TO other; CREATE VIEW entries AS WITH RECURSIVE c(a) AS "
        "(SELECT 1 UNION ALL SELECT a + 1 FROM c) SELECT other.* FROM other, c",
        "CREATE TRIGGER t AFTER INSERT ON kept_row BEGIN DELETE FROM kept_row; END",
    ],
    ids=["older", "a view that never ends", "a trigger"],
)
def test_a_file_of_another_form_is_made_anew(place: Place, monkeypatch: pytest.MonkeyPatch, script: str) -> None:
    with sqlite3.connect(place.file) as connection:
        connection.executescript(script)
    place.run("UPDATE person SET city = 2")
    forgotten = []
    forget = RememberedRows.forget
    monkeypatch.setattr(RememberedRows, "forget", lambda rows: forgotten.append(forget(rows)))
    place.follow()
    assert len(forgotten) == 1


@pytest.mark.parametrize(
    ("query", "reads"),
    [
        ("SELECT name, city FROM living", {"person", "city"}),
        ("WITH all_of AS (SELECT * FROM person) SELECT name FROM all_of", {"person"}),
        ("SELECT name FROM city WHERE id IN (SELECT city FROM visit)", {"city", "visit"}),
        ("SELECT UPPER(name) AS name FROM city", {"city"}),
        ("SELECT COUNT(*) AS name FROM city", {"city"}),
        ("SELECT '1' AS name", set()),
        ("SELECT name FROM stranger", None),
        ("SELECT rowid AS name FROM visit", None),  # VACUUM gives another
        ("SELECT name FROM city WHERE id < random()", None),
        ("SELECT name FROM city WHERE name < CURRENT_DATE", None),
        ("SELECT name FROM city WHERE name < date('now')", None),
        ("SELECT value AS name FROM json_each('[1]')", None),
    ],
)
def test_what_a_query_reads(place: Place, query: str, reads: set[str] | None) -> None:
    column = query.split(" FROM ")[0].split()[-1] if "WITH" not in query else "name"
    place.document.write_text(
        PREFIXES + f'<#Q> rr:logicalTable [ rr:sqlQuery """{query}""" ] ; '
        f'rr:subjectMap [ rr:template "http://example.com/{{{"name" if column != "city" else column}}}" ] .'
    )
    with planned(place.engine, [place.document]) as (_, (statement,)):
        assert statement.reads == reads


@pytest.mark.parametrize(
    ("query", "table"),
    [
        ("SELECT * FROM run", "run"),
        ("select run_id, kind from run where kind <> 'a''b' and n >= -1.5 AND x IS NOT NULL ", "run"),
        ("SELECT run_id FROM run GROUP BY run_id", None),
        ("SELECT MAX(run_id) AS run_id FROM run", None),
        ("SELECT name AS run_id FROM run", None),
        ("SELECT DISTINCT run_id FROM run", None),
        ("SELECT * FROM run LIMIT 5", None),
        ("SELECT * FROM run WHERE day < CURRENT_DATE", None),
        ("SELECT rowid, run_id FROM run", None),
        ("SELECT * FROM run, robot", None),
        ("SELECT * FROM other", None),
    ],
)
def test_queries_that_pick_rows_of_one_table(query: str, table: str | None) -> None:
    assert table_of(LogicalTable("", query=query), ["run", "robot"]) == table


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.system)])
def fleet(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Workspace]:
    url = None if request.param == "sqlite" else request.getfixturevalue("new_postgresql_database")()
    with Workspace(tmp_path / "fleet", url) as place:
        small_fleet.fill(place)
        yield place


def test_a_workspace_is_followed_by_its_notes(fleet: Workspace, read: list[str]) -> None:
    documents = [file.path for file in fleet.resources.of("mappings")]
    with KnowledgeGraph() as graph:
        workflow.map_rows(fleet, graph)

        def follow() -> None:
            read.clear()
            workflow.map_rows(fleet, graph)
            made = KnowledgeGraph()
            made.replace(map_database(fleet.engine, documents), GRAPH_SOURCE, GRAPH_ACTIVITY)
            for name in {*made.graphs(GRAPH_SOURCE, GRAPH_ACTIVITY), *graph.graphs(GRAPH_SOURCE, GRAPH_ACTIVITY)}:
                assert name == f"{GRAPH_SOURCE}version" or graph.triples(name) == made.triples(name)

        with fleet.engine.begin() as connection:
            connection.exec_driver_sql("UPDATE run_energy SET peak_power_w = 1 WHERE run_id = 'Arm_A.fit_1'")
        follow()
        if fleet.engine.dialect.name == "sqlite":
            assert read and all(TABLE in sql or "run_energy" in sql for sql in read)
        with staged(fleet, "Arm_C") as apart, apart.engine.begin() as connection:
            connection.exec_driver_sql("DELETE FROM run_energy")
        follow()
        fleet.drop_robot("Arm_B")
        follow()
