"""What PostgreSQL has beside the W3C's cases: its types, schemas and names, and mapping only what changed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from pyoxigraph import Literal, NamedNode
from sqlalchemy import Engine, create_engine

from irtwin.errors import InputError
from irtwin.knowledge.mapping import map_database, refresh
from irtwin.knowledge.store.graph import KnowledgeGraph

pytestmark = pytest.mark.system

XSD = "http://www.w3.org/2001/XMLSchema#"
PREFIXES = """
@prefix rr: <http://www.w3.org/ns/r2rml#> .
@prefix ex: <http://example.com/> .
@prefix xsd: <http://www.w3.org/2001/XMLSchema#> .
@prefix g: <https://w3id.org/irtwin/graph/source/> .
"""
THINGS = (
    PREFIXES
    + """
<#T> rr:logicalTable [ %s ] ; rr:subjectMap [ rr:template "http://example.com/{id}" ; rr:graph g:things ] ;
    rr:predicateObjectMap [ rr:predicate ex:p ; rr:objectMap [ rr:column "%s" ] ] .
"""
)


@pytest.fixture(scope="module")
def engine(new_postgresql_database: Callable[[], str]) -> Engine:
    return create_engine(new_postgresql_database(), connect_args={"options": "-c timezone=Asia/Tokyo"})


def run(engine: Engine, *statements: str) -> None:
    with engine.begin() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement, execution_options={"no_parameters": True})


def objects(engine: Engine, folder: Path, table: str, column: str) -> list[str]:
    document = folder / "a.r2rml.ttl"
    document.write_text(THINGS % (table, column))
    return sorted(str(quad.object) for quad in map_database(engine, [document]))


@pytest.mark.parametrize(
    ("value", "lexical", "datatype"),
    [
        ("'\\x01ff'::bytea", "01FF", "hexBinary"),
        ("true", "true", "boolean"),
        ("32767::smallint", "32767", "integer"),
        ("9223372036854775807::bigint", "9223372036854775807", "integer"),
        ("0.1::real", "1.0E-1", "double"),
        ("'NaN'::double precision", "NaN", "double"),
        ("'-Infinity'::double precision", "-INF", "double"),
        ("1.50::numeric(8, 2)", "1.5", "decimal"),
        ("1e30::numeric", "1" + 30 * "0", "decimal"),
        ("'NaN'::numeric", "NaN", "double"),  # no xsd:decimal is NaN
        ("'Infinity'::numeric", "INF", "double"),
        ("'2026-01-02'::date", "2026-01-02", "date"),
        ("'03:04:05.100'::time", "03:04:05.1", "time"),
        ("'2026-01-02 03:04:05'::timestamp", "2026-01-02T03:04:05", "dateTime"),
        ("'2026-01-02 03:04:05+02'::timestamptz", "2026-01-02T01:04:05Z", "dateTime"),  # whatever the server's zone
        ("'ab'::char(4)", "ab  ", "string"),
        # Types that the W3C does not name are strings as the database writes them.
        ("'1 month 2 days 03:04:05'::interval", "1 mon 2 days 03:04:05", "string"),
        ("array[1, 2]", "{1,2}", "string"),
        ("array['a', NULL]", "{a,NULL}", "string"),
        ("""'{"b": [1, "é"], "a": null}'::json""", '{"b": [1, "é"], "a": null}', "string"),
        ("'1'::jsonb", "1", "string"),
        ("'00000000-0000-0000-0000-000000000001'::uuid", "00000000-0000-0000-0000-000000000001", "string"),
        ("'192.168.0.1/24'::inet", "192.168.0.1/24", "string"),
        ("'[1,5)'::int4range", "[1,5)", "string"),
        ("B'101'", "101", "string"),
    ],
)
def test_types(engine: Engine, tmp_path: Path, value: str, lexical: str, datatype: str) -> None:
    table = f'rr:sqlQuery """SELECT 1 AS id, {value} AS v"""'.replace("\\", "\\\\")
    assert objects(engine, tmp_path, table, "v") == [str(Literal(lexical, datatype=NamedNode(XSD + datatype)))]


def test_a_time_that_python_has_none_for(engine: Engine, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"<T>: the database refuses it: .*infinity"):
        objects(engine, tmp_path, "rr:sqlQuery \"SELECT 1 AS id, 'infinity'::timestamp AS v\"", "v")


@pytest.mark.parametrize("what", ["n AS id", "sum(n) AS id"])
def test_sql_without_end(engine: Engine, tmp_path: Path, what: str) -> None:
    document = tmp_path / "a.r2rml.ttl"
    numbers = "WITH RECURSIVE t(n) AS (SELECT 1::numeric UNION ALL SELECT n + 1 FROM t)"
    document.write_text(THINGS % (f'rr:sqlQuery "{numbers} SELECT {what} FROM t"', "id"))
    with pytest.raises(InputError, match="<T>: its SQL has not ended after 1 s"):
        for _ in map_database(engine, [document], seconds=1):
            pass


def test_schemas_and_names_of_any_script(engine: Engine, tmp_path: Path) -> None:
    run(
        engine,
        "CREATE SCHEMA cell",
        'CREATE SCHEMA "Halle 2"',
        'CREATE TABLE cell.robot (id INTEGER, "größe" INTEGER, "per cent %" INTEGER, "a.b" INTEGER)',
        "INSERT INTO cell.robot VALUES (1, 7, 8, 9)",
        'CREATE TABLE "Halle 2"."Röbot" (id INTEGER, "Größe" TEXT)',
        """INSERT INTO "Halle 2"."Röbot" VALUES (1, '大')""",
        "CREATE TABLE public.robot (id INTEGER)",
        'CREATE VIEW cell.sizes AS SELECT id, "größe" AS n FROM cell.robot',
    )
    integer = f'"%s"^^<{XSD}integer>'
    assert objects(engine, tmp_path, 'rr:tableName "cell.robot"', "größe") == [integer % 7]
    assert objects(engine, tmp_path, 'rr:tableName "CELL.Robot"', '\\"per cent %\\"') == [integer % 8]
    assert objects(engine, tmp_path, 'rr:tableName "\\"cell\\".\\"robot\\""', '\\"a.b\\"') == [integer % 9]
    assert objects(engine, tmp_path, 'rr:tableName "\\"Halle 2\\".\\"Röbot\\""', '\\"Größe\\"') == ['"大"']
    assert objects(engine, tmp_path, 'rr:tableName "cell.sizes"', "n") == [integer % 7]
    assert objects(engine, tmp_path, 'rr:tableName "robot"', "id") == []  # an empty table
    with pytest.raises(InputError, match=r'no column n in its logical table, which has "id"'):
        objects(engine, tmp_path, 'rr:tableName "robot"', "n")


def test_only_what_changed(new_postgresql_database: Callable[[], str], tmp_path: Path) -> None:
    engine = create_engine(new_postgresql_database())
    run(
        engine,
        "CREATE TABLE t (id INTEGER PRIMARY KEY, b BYTEA, n NUMERIC, d TIMESTAMPTZ, day DATE, at TIME, a INTEGER[],"
        " j JSON)",
        r"INSERT INTO t SELECT i, '\x00ff', i + 0.50, '2026-01-02 03:04:05+02', '2026-01-02', '03:04', ARRAY[i], '[1]' "
        "FROM generate_series(1, 50) i",
    )
    columns = " ".join(
        f'rr:predicateObjectMap [ rr:predicate ex:{column} ; rr:objectMap [ rr:column "{column}" ] ] ;'
        for column in ("b", "n", "d", "day", "at", "a", "j")
    )
    document = tmp_path / "a.r2rml.ttl"
    document.write_text(
        PREFIXES + f'<#T> rr:logicalTable [ rr:tableName "t" ] ; {columns} '
        'rr:subjectMap [ rr:template "http://example.com/{id}" ; rr:graph g:things ] .'
    )
    graph = KnowledgeGraph()
    for change in (
        "UPDATE t SET n = 7 WHERE id = 3",
        "DELETE FROM t WHERE id > 40",
        "UPDATE t SET d = now(), a = NULL, j = NULL WHERE id < 4",
        "UPDATE t SET id = id",  # every row moves, none changes
        "TRUNCATE t",
    ):
        refresh(graph, engine, [document], tmp_path / "rows.db")
        run(engine, change)
        refresh(graph, engine, [document], tmp_path / "rows.db")
        made = KnowledgeGraph()
        made.replace(map_database(engine, [document]), "https://w3id.org/irtwin/graph/source/")
        assert graph.triples("https://w3id.org/irtwin/graph/source/things") == made.triples()
