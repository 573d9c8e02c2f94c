"""Behaviour of the R2RML processor on small databases; the W3C's own cases stand in tests/system."""

from __future__ import annotations

import itertools
import sqlite3
from pathlib import Path

import pytest
from pyoxigraph import Quad, RdfFormat, parse

from irtwin.errors import InputError
from irtwin.knowledge.mapping import map_database, map_to_file
from irtwin.storage.engine import open_engine

PREFIXES = """
@prefix rr: <http://www.w3.org/ns/r2rml#> .
@prefix ex: <http://example.com/> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
@base <http://example.com/base/> .
"""
PEOPLE = """
CREATE TABLE person (id INTEGER PRIMARY KEY, name VARCHAR, boss INTEGER, "Odd ""name" VARCHAR, "Shoe" INTEGER);
INSERT INTO person VALUES (1, 'Ada', NULL, 'x', 40), (2, 'Bo & Co/é', 1, NULL, 41);
"""
SUBJECT = 'rr:subjectMap [ rr:template "http://example.com/{id}" ]'


def person(objects: str, subject: str = SUBJECT, table: str = 'rr:tableName "person"') -> str:
    """A mapping of the table person with one property."""
    return f"<#P> rr:logicalTable [ {table} ] ; {subject} ; rr:predicateObjectMap [ rr:predicate ex:p ; {objects} ] ."


def written(folder: Path, mapping: str, sql: str = PEOPLE) -> tuple[str, Path]:
    """Write a database and a mapping document; return the URL of the one and the other."""
    with sqlite3.connect(folder / "a.db") as connection:
        connection.executescript(sql)
    document = folder / "a.r2rml.ttl"
    document.write_text(PREFIXES + mapping)
    return f"sqlite:///{folder}/a.db", document


def mapped(folder: Path, mapping: str, sql: str = PEOPLE, base_iri: str | None = None) -> set[str]:
    url, document = written(folder, mapping, sql)
    return {str(quad) for quad in map_database(open_engine(url), [document], base_iri)}


def objects(folder: Path, object_map: str, sql: str = PEOPLE) -> set[str]:
    """What the property of the person's mapping has as objects, in N-Triples."""
    return {quad.split(" ", 2)[2] for quad in mapped(folder, person(f"rr:objectMap [ {object_map} ]"), sql)}


@pytest.mark.parametrize(
    ("object_map", "expected"),
    [
        ('rr:column "name"', {'"Ada"', '"Bo & Co/é"'}),
        ('rr:column "NAME" ; rr:language "en-GB"', {'"Ada"@en-gb', '"Bo & Co/é"@en-gb'}),
        ('rr:column "\\"name\\"" ; rr:termType rr:Literal', {'"Ada"', '"Bo & Co/é"'}),
        ('rr:column "boss"', {'"1"^^<http://www.w3.org/2001/XMLSchema#integer>'}),  # NULL gives no triple
        ('rr:column "boss" ; rr:datatype xsd:double', {'"1"^^<http://www.w3.org/2001/XMLSchema#double>'}),
        ('rr:column "\\"Odd \\"\\"name\\""', {'"x"'}),
        ('rr:template "{name}!" ; rr:termType rr:Literal', {'"Ada!"', '"Bo & Co/é!"'}),
        ('rr:template "http://e.com/{name}"', {"<http://e.com/Ada>", "<http://e.com/Bo%20%26%20Co%2Fé>"}),
        ('rr:template "{boss}\\\\{\\\\}\\\\\\\\" ; rr:termType rr:Literal', {'"1{}\\\\"'}),
        ('rr:template "{boss}" ; rr:datatype xsd:integer', {'"1"^^<http://www.w3.org/2001/XMLSchema#integer>'}),
        ('rr:constant "c"@en', {'"c"@en'}),
        ("rr:constant ex:c", {"<http://example.com/c>"}),
        ('rr:template "{boss}"', {"<http://example.com/base/1>"}),
        ('rr:column "boss" ; rr:termType rr:BlankNode', {"_:b31"}),
    ],
)
def test_term_maps(tmp_path: Path, object_map: str, expected: set[str]) -> None:
    assert objects(tmp_path, object_map) == expected


@pytest.mark.parametrize(
    ("declared", "value", "expected"),
    [
        ("INTEGER", "7", '"7"^^xsd:integer'),
        ("VARCHAR(5)", "'7'", '"7"'),
        ("CHAR(3)", "'a'", '"a  "'),
        ("FLOAT", "50", '"5.0E1"^^xsd:double'),
        ("DOUBLE PRECISION", "0.1", '"1.0E-1"^^xsd:double'),
        ("REAL", "-1234.5", '"-1.2345E3"^^xsd:double'),
        ("REAL", "1e-07", '"1.0E-7"^^xsd:double'),
        ("REAL", "1.5e300", '"1.5E300"^^xsd:double'),
        ("REAL", "0", '"0.0E0"^^xsd:double'),
        ("REAL", "1e999", '"INF"^^xsd:double'),
        ("DECIMAL(10, 2)", "12.50", '"12.5"^^xsd:decimal'),
        ("NUMERIC", "100", '"100"^^xsd:decimal'),
        ("BOOLEAN", "1", '"true"^^xsd:boolean'),
        ("DATE", "'2026-01-02'", '"2026-01-02"^^xsd:date'),
        ("TIME", "'03:04:05'", '"03:04:05"^^xsd:time'),
        ("TIMESTAMP", "'2026-01-02 03:04:05.250000'", '"2026-01-02T03:04:05.25"^^xsd:dateTime'),
        ("DATETIME", "'2026-01-02 03:04:10.000000'", '"2026-01-02T03:04:10"^^xsd:dateTime'),
        ("TIMESTAMP", "'2026-01-02T03:04:05.10+00:00'", '"2026-01-02T03:04:05.1Z"^^xsd:dateTime'),
        ("BLOB", "X'00ff'", '"00FF"^^xsd:hexBinary'),
        # SQLite lets any value stand in any column: one that does not fit is what it is.
        ("INTEGER", "'seven'", '"seven"'),
        ("DATE", "'yesterday'", '"yesterday"'),
        ("", "7", '"7"^^xsd:integer'),
        ("ODD TYPE", "7.5", '"7.5E0"^^xsd:double'),
    ],
)
def test_natural_datatypes(tmp_path: Path, declared: str, value: str, expected: str) -> None:
    sql = f"CREATE TABLE person (id INTEGER, v {declared}); INSERT INTO person VALUES (1, {value});"
    found = objects(tmp_path, 'rr:column "v"', sql)
    assert {item.replace("<http://www.w3.org/2001/XMLSchema#", "xsd:").rstrip(">") for item in found} == {expected}


def test_declared_types_reach_through_a_query(tmp_path: Path) -> None:
    sql = "CREATE TABLE t (id INTEGER, day DATE); INSERT INTO t VALUES (1, '2026-01-02');"
    query = 'rr:sqlQuery "SELECT id, day AS Holiday, count(*) AS many FROM t GROUP BY id, day;"'
    found = mapped(tmp_path, person('rr:objectMap [ rr:column "Holiday" ], [ rr:column "many" ]', table=query), sql)
    assert found == {
        '<http://example.com/1> <http://example.com/p> "2026-01-02"^^<http://www.w3.org/2001/XMLSchema#date>',
        '<http://example.com/1> <http://example.com/p> "1"^^<http://www.w3.org/2001/XMLSchema#integer>',
    }


def test_a_table_that_changed_is_looked_at_again(tmp_path: Path) -> None:
    mapping = person('rr:objectMap [ rr:column "v" ]')
    for declared, expected in (("INTEGER", '"1"^^<http://www.w3.org/2001/XMLSchema#integer>'), ("TEXT", '"1"')):
        made = f"CREATE TABLE person (id, v {declared}); INSERT INTO person VALUES (1, '1');"
        (quad,) = mapped(tmp_path, mapping, f"DROP TABLE IF EXISTS person; {made}")
        assert quad.endswith(expected)


def test_a_document_that_is_gone_is_missed(tmp_path: Path) -> None:
    url, document = written(tmp_path, person("rr:object ex:o"))
    document.unlink()
    with pytest.raises(InputError, match=r"a\.r2rml\.ttl"):
        list(map_database(open_engine(url), [document]))


def test_a_query_may_hold_percent_colon_and_semicolon(tmp_path: Path) -> None:
    query = "rr:sqlQuery \"SELECT id, name || ' :x; %s ?' AS n FROM person WHERE name LIKE 'A%' -- ; not the end\""
    found = mapped(tmp_path, person('rr:objectMap [ rr:column "n" ]', table=query))
    assert found == {'<http://example.com/1> <http://example.com/p> "Ada :x; %s ?"'}


def test_classes_and_graphs(tmp_path: Path) -> None:
    subject = """rr:subjectMap [ rr:template "http://example.com/{id}" ; rr:class ex:A, ex:B ;
        rr:graphMap [ rr:template "http://example.com/g/{boss}" ] ]"""
    found = mapped(tmp_path, person('rr:object "o" ; rr:graph ex:h, rr:defaultGraph', subject))
    # Ada has no boss: where graph maps are given and make none, there is no triple.
    assert found == {
        "<http://example.com/2> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://example.com/A>"
        " <http://example.com/g/1>",
        "<http://example.com/2> <http://www.w3.org/1999/02/22-rdf-syntax-ns#type> <http://example.com/B>"
        " <http://example.com/g/1>",
        '<http://example.com/1> <http://example.com/p> "o" <http://example.com/h>',
        '<http://example.com/1> <http://example.com/p> "o"',
        '<http://example.com/2> <http://example.com/p> "o" <http://example.com/g/1>',
        '<http://example.com/2> <http://example.com/p> "o" <http://example.com/h>',
        '<http://example.com/2> <http://example.com/p> "o"',
    }


def test_joins(tmp_path: Path) -> None:
    join = """rr:objectMap [ rr:parentTriplesMap <#P> ; rr:joinCondition [ rr:child "boss" ; rr:parent "id" ] ]"""
    assert mapped(tmp_path, person(join)) == {"<http://example.com/2> <http://example.com/p> <http://example.com/1>"}


def test_a_parent_without_join_is_of_the_same_row(tmp_path: Path) -> None:
    other = '<#Q> rr:logicalTable [ rr:tableName "person" ] ; rr:subjectMap [ rr:template "http://q.com/{id}" ] .'
    assert mapped(tmp_path, person("rr:objectMap [ rr:parentTriplesMap <#Q> ]") + other) == {
        "<http://example.com/1> <http://example.com/p> <http://q.com/1>",
        "<http://example.com/2> <http://example.com/p> <http://q.com/2>",
    }


def test_relative_iris_lie_below_the_base(tmp_path: Path) -> None:
    mapping = person('rr:object "o"', 'rr:subjectMap [ rr:template "p/{id}" ]')
    assert "<http://example.com/base/p/1>" in " ".join(mapped(tmp_path, mapping))
    (tmp_path / "a.db").unlink()
    assert "<http://other.org/p/1>" in " ".join(mapped(tmp_path, mapping, base_iri="http://other.org/"))


def test_rows_are_read_as_they_are_needed(tmp_path: Path) -> None:
    """A million rows behind the first few quads cost nothing."""
    sql = "CREATE VIEW many AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM n) SELECT i AS id FROM n;"
    url, document = written(tmp_path, person('rr:objectMap [ rr:column "id" ]', table='rr:tableName "many"'), sql)
    engine = open_engine(url)
    first: list[Quad] = list(itertools.islice(map_database(engine, [document]), 12_000))
    assert first[-1].object.value == "12000"  # type: ignore[union-attr]
    engine.dispose()


def test_a_file_is_written_whole_or_not_at_all(tmp_path: Path) -> None:
    (url, document), out = written(tmp_path, person('rr:objectMap [ rr:column "name" ]')), tmp_path / "out.nq"
    map_to_file(document, url, out)
    assert len(list(parse(out.read_bytes(), RdfFormat.N_QUADS))) == 2
    before = out.read_bytes()
    document.write_text(PREFIXES + person('rr:objectMap [ rr:column "name" ; rr:termType rr:IRI ]'))
    with pytest.raises(InputError, match="makes no valid IRI"):
        map_to_file(document, url, out)
    assert out.read_bytes() == before
    assert {file.name for file in tmp_path.iterdir()} == {"a.db", document.name, out.name}


def test_where_to_write_must_exist(tmp_path: Path) -> None:
    for out in (tmp_path / "none" / "out.nq", tmp_path):
        with pytest.raises(InputError, match="cannot be written"):
            map_to_file(tmp_path / "a.ttl", "sqlite:///a.db", out)
