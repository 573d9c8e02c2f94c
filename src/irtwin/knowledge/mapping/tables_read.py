"""Which tables a query reads, where its rows follow from what stands in them and from nothing else."""

from __future__ import annotations

import re
import sqlite3
from collections.abc import Collection, Container, Iterable
from contextlib import closing

from sqlalchemy import Connection

from irtwin.knowledge.mapping.document import LogicalTable

# Built-in functions of SQLite whose values change while no table does.
_OF_THE_MOMENT = {
    "changes", "current_date", "current_time", "current_timestamp", "date", "datetime", "julianday",
    "last_insert_rowid", "random", "randomblob", "strftime", "time", "timediff", "total_changes", "unixepoch",
}  # fmt: skip
_SYSTEM = r"rowid|oid|_rowid_|ctid|[cx]min|[cx]max|tableoid|current_\w+|localtime\w*|(?:session_|system_)?user"
_NAME = rf"(?!(?:{_SYSTEM})\b)[a-z_]\w*"
_CONDITION = rf"{_NAME}\s*(?:(?:=|<>|!=|<=?|>=?)\s*(?:'(?:[^']|'')*'|-?\d+(?:\.\d+)?)|\sIS(?:\s+NOT)?\s+NULL)"
_PICKED = re.compile(
    rf"\s*SELECT\s+(?:\*|{_NAME}(?:\s*,\s*{_NAME})*)\s+FROM\s+({_NAME})"
    rf"(?:\s+WHERE\s+{_CONDITION}(?:\s+AND\s+{_CONDITION})*)?\s*",
    re.IGNORECASE,
)


def table_of(logical: LogicalTable, tables: Iterable[str]) -> str | None:
    """Return the one among tables whose rows a logical table shows, all or some, each by itself; None where none is."""
    names = list(tables)
    if logical.query is None:
        return logical.table[0].find(names, folded=True) if len(logical.table) == 1 else None
    picked = _PICKED.fullmatch(logical.query)
    return picked[1].lower() if picked and picked[1].lower() in names else None


def tables_read(
    connection: Connection, sql: str, sides: Iterable[LogicalTable], tables: Collection[str]
) -> frozenset[str] | None:
    """Return which of these tables a query over logical tables reads; None where it may read something else.

    In SQLite the database itself says it, of any query; in others only of sides that `table_of` tells.
    """
    driver = connection.connection.driver_connection
    if isinstance(driver, sqlite3.Connection):
        return _authorized(driver, sql, tables)
    found = {table_of(side, tables) for side in sides}
    return None if None in found else frozenset(name for name in found if name is not None)


def _authorized(driver: sqlite3.Connection, sql: str, tables: Container[str]) -> frozenset[str] | None:
    """Ask SQLite, which tells each table, column and function of a query, through views too, when it compiles it."""
    found: set[str] = set()
    views = {name for (name,) in driver.execute("SELECT name FROM main.sqlite_master WHERE type = 'view'")}
    own = {name for (name,) in driver.execute("SELECT name FROM pragma_function_list WHERE builtin")}
    told = True

    def note(action: int, first: str | None, second: str | None, schema: str | None, _: str | None) -> int:
        nonlocal told
        if action == sqlite3.SQLITE_FUNCTION:
            told = told and second in own and second not in _OF_THE_MOMENT
        elif action == sqlite3.SQLITE_READ and first not in views:
            told = told and first in tables and schema in ("main", None) and second != "ROWID"
            found.add(str(first))
        return sqlite3.SQLITE_OK

    driver.set_authorizer(note)
    try:
        with closing(driver.execute(f"EXPLAIN {sql}")):
            pass
    finally:
        driver.set_authorizer(None)
    return frozenset(found) if told else None
