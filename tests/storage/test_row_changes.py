"""Who writes a row of a noted table leaves a note of its key; no change goes without."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import Engine

from irtwin.storage.database import Workspace
from irtwin.storage.engine import open_engine
from irtwin.storage.row_changes import TABLE, KeyColumn, keep_notes, noted_tables
from irtwin.storage.schema import Base

TABLES = (
    "CREATE TABLE city (name VARCHAR(50) PRIMARY KEY, area INTEGER)",
    'CREATE TABLE "person\'s" (city VARCHAR(50) REFERENCES city ON DELETE CASCADE, number INTEGER, "a ""b""" INTEGER, '
    "PRIMARY KEY (number, city))",
    "CREATE TABLE visit (city VARCHAR(50))",
    "CREATE TABLE weighed (mass DOUBLE PRECISION PRIMARY KEY)",
    "CREATE TABLE stranger (id INTEGER PRIMARY KEY)",
    "INSERT INTO city VALUES ('Rom', 1), ('Oslo', 2), ('Bonn', 3)",
    "INSERT INTO \"person's\" VALUES ('Rom', 1, 0), ('Rom', 2, 0), ('Oslo', 1, 0)",
)
NOTED = ("city", "person's", "visit", "weighed")


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.system)])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'a.db'}"
    return str(request.getfixturevalue("new_postgresql_database")())


@pytest.fixture
def engine(url: str) -> Iterator[Engine]:
    engine = open_engine(url)
    run(engine, *TABLES)
    keep_notes(engine, NOTED)
    yield engine
    engine.dispose()


def run(engine: Engine, *statements: str) -> None:
    with engine.begin() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement)


def notes(engine: Engine) -> set[tuple[str, ...]]:
    with engine.connect() as connection:
        rows = connection.exec_driver_sql(f"SELECT table_name, key_1, key_2 FROM {TABLE} WHERE table_name <> ''")
        return {tuple(str(value) for value in row if value is not None) for row in rows}


def test_tables_and_their_keys(engine: Engine) -> None:
    keep_notes(engine, NOTED)
    with engine.connect() as connection:
        assert noted_tables(connection) == {
            "city": (KeyColumn("name", False),),
            "person's": (KeyColumn("number", True), KeyColumn("city", False)),
            "visit": (),
            "weighed": (),  # numbers with a point may be written in several ways
        }
    assert notes(engine) == set()


@pytest.mark.parametrize(
    ("change", "noted"),
    [
        ("INSERT INTO city VALUES ('Kiel', 4)", {("city", "Kiel")}),
        ("UPDATE city SET area = 9 WHERE area > 1", {("city", "Oslo"), ("city", "Bonn")}),
        ("UPDATE city SET name = 'Berlin' WHERE area = 3", {("city", "Bonn"), ("city", "Berlin")}),
        ("UPDATE city SET area = 9 WHERE area > 7", set()),
        ('DELETE FROM "person\'s" WHERE number = 2', {("person's", "2", "Rom")}),
        ("DELETE FROM city WHERE name = 'Oslo'", {("city", "Oslo"), ("person's", "1", "Oslo")}),
        ("INSERT INTO visit VALUES ('Rom'), ('Rom')", {("visit",)}),
        ("INSERT INTO weighed VALUES (0.1)", {("weighed",)}),
        ("INSERT INTO stranger VALUES (1)", set()),
        ("INSERT INTO city VALUES ('Rom', 7) ON CONFLICT (name) DO UPDATE SET area = 7", {("city", "Rom")}),
        ("INSERT INTO city VALUES ('Rom', 7) ON CONFLICT DO NOTHING", set()),
    ],
)
def test_what_a_change_notes(engine: Engine, change: str, noted: set[tuple[str, ...]]) -> None:
    run(engine, change)
    assert notes(engine) == noted


def test_what_is_taken_back_is_not_noted(engine: Engine) -> None:
    with engine.connect() as connection:
        connection.exec_driver_sql("DELETE FROM city WHERE name = 'Bonn'")
        connection.rollback()
    assert notes(engine) == set()


def test_a_table_made_anew_is_noted_again(engine: Engine) -> None:
    run(engine, "DROP TABLE visit", "CREATE TABLE visit (id INTEGER PRIMARY KEY)")
    with engine.connect() as connection:
        assert "visit" not in noted_tables(connection)
    keep_notes(engine, NOTED)
    run(engine, "INSERT INTO visit VALUES (7)")
    assert notes(engine) == {("visit", "7")}


def test_all_tables_of_a_workspace_are_noted(url: str, tmp_path: Path) -> None:
    with Workspace(tmp_path / "place", url) as place:
        place.note_changes()
        with place.engine.connect() as connection:
            found = noted_tables(connection)
        assert found.keys() == Base.metadata.tables.keys()
        assert {name for name, key in found.items() if not key} <= {"live_state"}
