"""Mapping documents that are broken or meant to do harm; faults of those who write one are in test_mapping_errors."""

from __future__ import annotations

import os
import re
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

PREFIXES = (
    "@prefix rr: <http://www.w3.org/ns/r2rml#> . @prefix : <http://e/> . "
    "@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .\n"
)
TABLE = '<#M> rr:logicalTable [ rr:tableName "person" ] ; '
SUBJECT = 'rr:subjectMap [ rr:template "http://e/{id}" ] '


def query(sql: str) -> str:
    return f'<#M> rr:logicalTable [ rr:sqlQuery """{sql}""" ] ; {SUBJECT}.'


DATABASE = "the database refuses it"
ENDLESS = "<M>: its SQL has not ended after 2 s; correct it"
NUMBERS = "WITH RECURSIVE number(n) AS (SELECT 1 UNION ALL SELECT n + 1 FROM number)"
SQL = {
    "drop": (query("DROP TABLE person"), DATABASE),
    "delete": (query("DELETE FROM person"), DATABASE),
    "delete that returns": (query("DELETE FROM person RETURNING id"), DATABASE),
    "insert in a WITH": (query("WITH x AS (INSERT INTO person VALUES (9) RETURNING id) SELECT * FROM x"), DATABASE),
    "two statements": (query("SELECT id FROM person; DROP TABLE person"), "more than one statement"),
    "comment before the second": (query("SELECT id FROM person; -- x\nDROP TABLE person"), "more than one statement"),
    "out of the bracket": (query("SELECT 1 AS id) source; DROP TABLE person; --"), "more than one statement|refuses"),
    "out of the bracket, quietly": (query("SELECT 1 AS id) source UNION SELECT (2"), DATABASE),
    "attach": (query("ATTACH DATABASE '/etc/passwd' AS other"), DATABASE),
    "vacuum into": (query("VACUUM INTO '/dev/null'"), DATABASE),
    "pragma": (query("PRAGMA writable_schema = 1"), DATABASE),
    "extension": (query("SELECT load_extension('/lib/x.so') AS id"), DATABASE),
    "read a file": (query("SELECT readfile('/etc/passwd') AS id"), DATABASE),
    "write a file": (query("SELECT writefile('/dev/null', 'x') AS id"), DATABASE),
    "a text of 2 GB": (query("SELECT hex(zeroblob(1000000000)) AS id"), DATABASE),
    "a random gigabyte": (query("SELECT randomblob(1000000000) AS id"), DATABASE),
    "deep expression": (query("SELECT " + "(" * 5000 + "1" + ")" * 5000 + " AS id"), DATABASE),
    "many terms": (query("SELECT 1" + " + 1" * 100_000 + " AS id"), DATABASE),
    "many unions": (query(" UNION ALL ".join(["SELECT 1 AS id"] * 5000)), DATABASE),
    "many joins": (query("SELECT a0.id FROM " + ", ".join(f"person a{n}" for n in range(200))), DATABASE),
    "many columns": (query("SELECT " + ", ".join(f"1 AS c{n}" for n in range(50_000))), DATABASE),
    "rows without end": (query(f"{NUMBERS} SELECT n AS id FROM number"), ENDLESS),
    "no row, without end": (query(f"{NUMBERS} SELECT n AS id FROM number WHERE n < 0"), ENDLESS),
    "a sum without end": (query(f"{NUMBERS} SELECT sum(n) AS id FROM number"), ENDLESS),
    "open string": (query("SELECT 'a AS id"), DATABASE),
    "open comment": (query("SELECT 1 AS id /*"), DATABASE),
    "nothing": (query(" "), DATABASE),
    "injection by name": (
        TABLE.replace("person", 'x\\"; DROP TABLE person; --') + SUBJECT + ".",
        "is no SQL table name",
    ),
}
DOCUMENTS = {
    "nothing": ("", "no rr:TriplesMap"),
    "another ontology": (":a a :b .", "no rr:TriplesMap"),
    "a query": ("SELECT * { ?s ?p ?o }", "line 2"),
    "open": ("<#M> rr:logicalTable", "line 2"),
    "deep": (":a :b " + "[ :b " * 100_000, "line 2"),
    "triples in triples": ("<< " * 100_000, "nested more than"),
    "open template": (f'{TABLE}rr:subjectMap [ rr:template "http://e/{{id" ] .', "unpaired"),
    "a template of a megabyte": (f'{TABLE}rr:subjectMap [ rr:template "{"{id}" * 300_000}{{" ] .', "unpaired"),
    "table of itself": ("<#M> rr:logicalTable <#M> ; rr:subjectMap <#M> .", "does not belong|missing|give"),
    "a term of 20 MB": (f'<#M> :b "{"x" * 20_000_000}" .', "a term of more than 16 MB"),
}


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    with sqlite3.connect(tmp_path / "data.db") as connection:
        connection.execute("CREATE TABLE person (id INTEGER, name VARCHAR)")
        connection.execute("INSERT INTO person VALUES (1, 'Bo & Co <x>')")
    return tmp_path


def check(refused: Callable[..., str], folder: Path, text: str, message: str, database: str = "") -> None:
    (folder / "input.ttl").write_text(PREFIXES + text, encoding="utf-8")
    said = refused("mapping", str(folder), database)
    assert re.search(message, said), said
    with sqlite3.connect(folder / "data.db") as connection:
        assert connection.execute("SELECT count(*) FROM person").fetchall() == [(1,)]


@pytest.mark.parametrize("name", SQL)
def test_sql(refused: Callable[..., str], folder: Path, name: str) -> None:
    check(refused, folder, *SQL[name])


@pytest.mark.parametrize("name", DOCUMENTS)
def test_documents(refused: Callable[..., str], folder: Path, name: str) -> None:
    check(refused, folder, *DOCUMENTS[name])


@pytest.mark.parametrize(
    ("database", "message"),
    [
        ("nonsense", "the database URL cannot be read"),
        ("sqlite:////nowhere/data.db", "no such SQLite database"),
        ("sqlite:////etc/passwd", "file is not a database"),
        ("oracle://user:secret@host/x", "no driver for this database"),
        ("postgresql://user:secret@127.0.0.1:1/x", "cannot open the database"),
    ],
)
def test_databases(refused: Callable[..., str], folder: Path, database: str, message: str) -> None:
    (folder / "input.ttl").write_text(PREFIXES + TABLE + SUBJECT + ".")
    said = refused("mapping", str(folder), database)
    assert re.search(message, said) and "secret" not in said, said


def test_what_is_no_file(refused: Callable[..., str], folder: Path) -> None:
    os.mkfifo(folder / "input.ttl")
    assert "is not a file" in refused("mapping", str(folder), "")
    (folder / "input.ttl").unlink()
    (folder / "input.ttl").symlink_to("/dev/zero")
    assert "is not a file" in refused("mapping", str(folder), "")
    (folder / "input.ttl").unlink()
    assert "cannot be read" in refused("mapping", str(folder), "")
