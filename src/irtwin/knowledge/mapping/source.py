"""Logical tables as a database shows them (W3C R2RML, section 5)."""

from __future__ import annotations

import math
import re
import sqlite3
import time
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection, CursorResult, Engine
from sqlalchemy.exc import DBAPIError

from irtwin.errors import InputError
from irtwin.knowledge.mapping.document import LogicalTable
from irtwin.knowledge.mapping.identifiers import Identifier, quoted
from irtwin.knowledge.mapping.natural import Natural, by_declared_type, by_value

_CHUNK = 5000  # rows fetched at a time
_STEPS = 100_000  # of SQLite's machine, about a millisecond, between two looks at the clock
# bool, bytea, int8, int2, int4, text, float4, float8, bpchar, varchar,
# date, time, timestamp, timestamptz, timetz, numeric: the types of section 10.2
_NATURAL_IN_POSTGRESQL = {16, 17, 20, 21, 23, 25, 700, 701, 1042, 1043, 1082, 1083, 1114, 1184, 1266, 1700}
_SQL_TOKEN = re.compile(r"""'(?:[^']|'')*'|"(?:[^"]|"")*"|--[^\n]*|/\*.*?\*/|[^'";/-]+|.""", re.DOTALL)


@dataclass(frozen=True)
class TableSource:
    """A logical table in SQL, with its columns and how their values read.

    cast: the columns whose values only the database itself can write as strings;
    folded: whether the columns are a table's, so that a regular identifier means a folded name.
    """

    sql: str
    columns: dict[str, Natural]
    cast: frozenset[str]
    folded: bool

    def column(self, identifier: Identifier, where: str) -> str:
        """Return the name of the column that an identifier means. Raises InputError where there is none."""
        name = identifier.find(self.columns, self.folded)
        if name is None:
            raise InputError(
                f"{where}: no column {identifier} in its logical table, which has "
                f"{', '.join(str(Identifier(name, delimited=True)) for name in self.columns)}"
            )
        return name


def snapshot_options(engine: Engine) -> dict[str, Any]:
    """Return the execution options of a transaction that reads one state and can write nothing."""
    if engine.dialect.name == "postgresql":
        return {"isolation_level": "REPEATABLE READ", "postgresql_readonly": True}
    return {}  # in SQLite a transaction is a snapshot, and what stands in FROM (...) cannot write


@contextmanager
def snapshot(engine: Engine, seconds: float = math.inf) -> Iterator[Connection]:
    """Give a connection that shows one state of the database and can write nothing.

    `seconds`: how long `run` and `read` may take from the start of a query to its last row.
    """
    with engine.connect() as connection:
        connection.execution_options(**snapshot_options(engine))
        connection.info["seconds"] = seconds
        with connection.begin(), _interrupted_when_late(connection):
            if engine.dialect.name == "postgresql":
                connection.exec_driver_sql("SET LOCAL TIME ZONE 'UTC'")  # whatever the server's or the client's is
                if seconds < math.inf:
                    connection.exec_driver_sql(f"SET LOCAL statement_timeout = {math.ceil(seconds * 1000)}")
            yield connection


def declarations(connection: Connection) -> tuple[str, ...] | None:
    """Return what declares the tables and views of a database in SQLite; None in others, which are asked each time."""
    if connection.dialect.name != "sqlite":
        return None
    rows = connection.exec_driver_sql("SELECT sql FROM main.sqlite_master WHERE sql IS NOT NULL ORDER BY type, name")
    return tuple(rows.scalars())


def describe(connection: Connection, table: LogicalTable) -> TableSource:
    """Find a logical table's columns. Raises InputError where it is not there or the query is not valid."""
    sql = _from_item(connection, table)
    result = run(connection, f"SELECT * FROM {sql} source WHERE 1 = 0", table.where)
    description = result.cursor.description if result.cursor else []
    names = [column[0] for column in description]
    result.close()
    repeated = _repeated(names, connection.dialect.name)
    if repeated:
        raise InputError(f"{table.where}: column {repeated} occurs more than once; rename it with AS")
    columns: dict[str, Natural] = dict.fromkeys(names, by_value)
    if connection.dialect.name == "sqlite":
        columns |= _declared(connection, sql, table.where)
    cast: frozenset[str] = frozenset()
    if connection.dialect.name == "postgresql":
        cast = frozenset(column[0] for column in description if column[1] not in _NATURAL_IN_POSTGRESQL)
    return TableSource(sql, columns, cast, folded=table.query is None)


def read(connection: Connection, sql: str, where: str) -> Iterator[Sequence[Sequence[Any]]]:
    """Yield a query's rows in chunks, one of them in memory at a time. Raises InputError as `run` does."""
    result = run(connection, sql, where)
    try:
        for rows in result.partitions(_CHUNK):
            if _late(connection):
                raise _endless(connection, where)
            yield rows
    except DBAPIError as error:
        raise _refused(connection, where, error) from None
    finally:
        result.close()


def run(connection: Connection, sql: str, where: str) -> CursorResult[Any]:
    """Run SQL as it stands: `%` and `:` mean nothing here. Raises InputError where it fails or takes too long."""
    connection.info["deadline"] = time.monotonic() + connection.info["seconds"]
    options = {"no_parameters": True, "stream_results": True, "max_row_buffer": _CHUNK}
    try:
        return connection.exec_driver_sql(sql, execution_options=options)
    except DBAPIError as error:
        raise _refused(connection, where, error) from None


def _from_item(connection: Connection, table: LogicalTable) -> str:
    if table.query is None:
        preparer = connection.dialect.identifier_preparer
        return ".".join(quoted(part.name, preparer) if part.delimited else part.name for part in table.table)
    return f"({_single_query(table.query, table.where)}\n)"


def _single_query(query: str, where: str) -> str:
    """Return a query without the semicolon at its end. Raises InputError where more follows."""
    tokens = _SQL_TOKEN.findall(query)
    if ";" not in tokens:
        return query
    end = tokens.index(";")
    if any(token.strip(";").strip() and not token.startswith(("--", "/*")) for token in tokens[end:]):
        raise InputError(f"{where}: rr:sqlQuery holds more than one statement; give one query")
    return "".join(tokens[:end])


def _declared(connection: Connection, sql: str, where: str) -> dict[str, Natural]:
    """SQLite tells a column's declared type, through expressions too, only for a view."""
    run(connection, f"CREATE TEMP VIEW irtwin_described AS SELECT * FROM {sql} source", where)
    result = run(connection, "PRAGMA temp.table_info(irtwin_described)", where)
    declared = {row["name"]: by_declared_type(row["type"]) for row in result.mappings()}
    run(connection, "DROP VIEW temp.irtwin_described", where)
    return declared


def _repeated(names: Sequence[str], dialect: str) -> str | None:
    if dialect == "sqlite":  # it renames the second of two columns X to X:1
        names = [name.rsplit(":", 1)[0] if name.rsplit(":", 1)[0] in names else name for name in names]
    return next((name for name, count in Counter(names).items() if count > 1), None)


@contextmanager
def _interrupted_when_late(connection: Connection) -> Iterator[None]:
    """Have SQLite look at the clock; other databases do so themselves, or `read` does between two chunks."""
    driver = connection.connection.driver_connection
    if not isinstance(driver, sqlite3.Connection):
        yield
        return
    driver.set_progress_handler(lambda: _late(connection), _STEPS)
    try:
        yield
    finally:
        driver.set_progress_handler(None, 0)


def _late(connection: Connection) -> bool:
    return time.monotonic() > float(connection.info.get("deadline", math.inf))


def _endless(connection: Connection, where: str) -> InputError:
    seconds = connection.info["seconds"]
    return InputError(
        f"{where}: its SQL has not ended after {seconds:g} s; correct it, or give `irtwin workspace map` more time "
        "with --timeout"
    )


def _refused(connection: Connection, where: str, error: DBAPIError) -> InputError:
    if _late(connection):
        return _endless(connection, where)
    return InputError(f"{where}: the database refuses it: {str(error.orig).strip().splitlines()[0]}")
