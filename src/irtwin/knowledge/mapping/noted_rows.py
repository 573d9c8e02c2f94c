"""What a database's notes say of the rows that changed since a mapping (`storage.row_changes` has them written)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from sqlalchemy import Connection

from irtwin.knowledge.mapping.identifiers import quoted
from irtwin.storage.row_changes import KEYS, TABLE, Key

# A transaction of PostgreSQL may end after a later one: what is older than any that had not ended has been seen.
_ORDER = {"sqlite": "number", "postgresql": "transaction"}
_UNTIL = {
    "sqlite": f"SELECT max(number) + 1 FROM {TABLE}",
    "postgresql": "SELECT txid_snapshot_xmin(txid_current_snapshot())",
}


@dataclass(frozen=True)
class Bookmark:
    """How far notes were seen: all before `until`, the last of them by its number and what nobody else would draw."""

    until: int
    number: int
    token: int


def bookmark(connection: Connection) -> Bookmark | None:
    """Return how far a snapshot's notes go, None where there is none to know them by later."""
    order = _ORDER[connection.dialect.name]
    until = connection.exec_driver_sql(_UNTIL[connection.dialect.name]).scalar()
    last = connection.exec_driver_sql(
        f"SELECT number, token FROM {TABLE} WHERE {order} < {until or 0} ORDER BY {order} DESC, number DESC LIMIT 1"
    ).first()
    return None if last is None else Bookmark(int(until or 0), *last)


def are_all_there(connection: Connection, since: Bookmark) -> bool:
    """Whether no note after a bookmark has gone, and the database is the one that it is of."""
    last = f"SELECT 1 FROM {TABLE} WHERE number = {since.number} AND token = {since.token}"
    return connection.exec_driver_sql(last).first() is not None


@dataclass(frozen=True)
class KeyedTable:
    """The one table that a statement reads row by row, and where its key stands among the statement's columns."""

    name: str
    key: Key
    places: tuple[int, ...]


class NotedRows:
    """The rows that were noted after a bookmark."""

    def __init__(self, connection: Connection, since: Bookmark) -> None:
        self._connection = connection
        self._preparer = connection.dialect.identifier_preparer
        self._since = f"{_ORDER[connection.dialect.name]} >= {since.until}"
        tables = connection.exec_driver_sql(f"SELECT DISTINCT table_name FROM {TABLE} WHERE {self._since}")
        self.tables = frozenset(tables.scalars())

    def keys(self, table: KeyedTable) -> list[tuple[Any, ...]] | None:
        """Return the keys of a table's rows that were noted, None where a note means more than one row."""
        found = [tuple(row) for row in self._connection.exec_driver_sql(self._keys(table))]
        return None if any(part is None for key in found for part in key) else found

    def condition(self, table: KeyedTable) -> str:
        """Return the SQL that holds for the noted rows of a table, which a statement names `child`."""
        columns = ", ".join(f"child.{quoted(part.name, self._preparer)}" for part in table.key)
        return f"({columns}) IN ({self._keys(table)})"

    def _keys(self, table: KeyedTable) -> str:
        parts = (f"CAST({at} AS bigint)" if part.is_number else at for at, part in zip(KEYS, table.key, strict=False))
        name = table.name.replace("'", "''")
        return f"SELECT DISTINCT {', '.join(parts)} FROM {TABLE} WHERE table_name = '{name}' AND {self._since}"
