"""The rows of a database as they were when they were last mapped, in an SQLite file of their own."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from datetime import date, datetime, time
from decimal import Decimal
from pathlib import Path
from typing import Any, Self
from zlib import crc32

import numpy as np
import numpy.typing as npt

from irtwin.errors import InputError
from irtwin.knowledge.mapping.natural import by_value
from irtwin.knowledge.mapping.terms import Row

# One for each row of a statement, in the order of the hashes: 64 bits tell rows apart, and find those of a subject.
ENTRY = np.dtype([("row", np.uint64), ("subject", np.uint64), ("id", np.int64)])
Entries = npt.NDArray[np.void]

_FORM = 3  # of the file, as its `user_version`
_TABLES = (
    "CREATE TABLE version (name TEXT NOT NULL)",
    "CREATE TABLE entries (number INTEGER PRIMARY KEY, content BLOB NOT NULL, crc INTEGER NOT NULL)",
    "CREATE TABLE kept_row (id INTEGER PRIMARY KEY, content TEXT NOT NULL, crc INTEGER NOT NULL)",
)
_KEPT_ROW = "SELECT CAST(content AS BLOB), crc FROM kept_row WHERE id = ?"  # damaged, it may be no text
_RESTORED: dict[str, Callable[[str], Any]] = {
    "bytes": bytes.fromhex,
    "Decimal": Decimal,
    "date": date.fromisoformat,
    "time": time.fromisoformat,
    "datetime": datetime.fromisoformat,
}


class DamagedRows(Exception):
    """What is remembered is not what was written."""


class RememberedRows:
    """One transaction on the file: what is done in the block is kept if it ends well, and is undone if not."""

    def __init__(self, file: Path) -> None:
        self._file = file

    def __enter__(self) -> Self:
        self._connection = _opened(self._file)
        self._next = self._connection.execute("SELECT coalesce(max(id), 0) + 1 FROM kept_row").fetchone()[0]
        return self

    def __exit__(self, kind: type[BaseException] | None, *_: object) -> None:
        with closing(self._connection):  # undoes what was not committed
            if kind is None:
                self._connection.execute("COMMIT")

    @property
    def version(self) -> str | None:
        """The name of the state that the rows are of, None where there is none."""
        row = self._connection.execute("SELECT name FROM version").fetchone()
        return None if row is None else str(row[0])

    @version.setter
    def version(self, name: str) -> None:
        self._connection.execute("DELETE FROM version")
        self._connection.execute("INSERT INTO version VALUES (?)", (name,))

    def forget(self) -> None:
        """Start anew, with no rows."""
        for table in ("version", "entries", "kept_row"):
            self._connection.execute(f"DELETE FROM {table}")
        self._next = 1

    def entries(self, statement: int) -> Entries:
        """Return the entries of a statement's rows, (N,) of ENTRY, by rising hash."""
        row = self._connection.execute("SELECT content, crc FROM entries WHERE number = ?", (statement,)).fetchone()
        return np.frombuffer(b"" if row is None else _checked(*row), ENTRY)

    def set_entries(self, statement: int, entries: Entries) -> None:
        """Keep a statement's entries in place of those it had, each row once."""
        _, first = np.unique(entries["row"], return_index=True)
        self.drop(np.delete(entries, first))
        content = entries[first].tobytes()
        self._connection.execute(
            "INSERT OR REPLACE INTO entries VALUES (?, ?, ?)", (statement, content, crc32(content))
        )

    def keep(self, rows: Sequence[Row]) -> range:
        """Keep rows; return their numbers."""
        ids = range(self._next, self._next + len(rows))
        self._next += len(rows)
        contents = (json.dumps(list(row), default=_tagged) for row in rows)
        self._connection.executemany(
            "INSERT INTO kept_row VALUES (?, ?, ?)",
            ((number, content, crc32(content.encode())) for number, content in zip(ids, contents, strict=True)),
        )
        return ids

    def rows(self, entries: Entries) -> Iterator[list[Any]]:
        """Yield the kept rows of these entries."""
        for number in entries["id"].tolist():
            row = self._connection.execute(_KEPT_ROW, (number,)).fetchone()
            if row is None:
                raise DamagedRows
            yield json.loads(_checked(*row), object_hook=_restored)

    def drop(self, entries: Entries) -> None:
        """Drop the kept rows of these entries."""
        self._connection.executemany(
            "DELETE FROM kept_row WHERE id = ?", ((number,) for number in entries["id"].tolist())
        )


def _opened(file: Path) -> sqlite3.Connection:
    """Open the file, in place of a broken one: what it holds can be had from the database again."""
    try:
        connection = sqlite3.connect(file, isolation_level=None)
        _make_tables(connection)
        connection.execute("BEGIN IMMEDIATE")
        return connection
    except sqlite3.OperationalError as error:
        raise InputError(f"{file}: cannot be written: {error}") from None
    except sqlite3.DatabaseError:
        file.unlink()
        return _opened(file)


def _make_tables(connection: sqlite3.Connection) -> None:
    """Make the tables of a new file. Raises DatabaseError where it has others: a view in place of one may never end."""
    form = connection.execute("PRAGMA user_version").fetchone()[0]
    there = [sql for (sql,) in connection.execute("SELECT sql FROM sqlite_master")]
    if form == _FORM and there == list(_TABLES):
        return
    if there:
        connection.close()
        raise sqlite3.DatabaseError(f"a file of form {form}")
    made = ("BEGIN EXCLUSIVE", *_TABLES, f"PRAGMA user_version = {_FORM}", "COMMIT", "")
    connection.executescript(";\n".join(made))


def _checked(content: bytes, crc: int) -> bytes:
    if crc32(content) != crc:
        raise DamagedRows
    return content


def _tagged(value: Any) -> Any:
    """What JSON has no notation for, so that its natural literal stays the same."""
    if isinstance(value, (bytes, memoryview)):
        return {"bytes": bytes(value).hex()}
    if isinstance(value, Decimal):
        return {"Decimal": str(value)}
    if isinstance(value, (date, time)):
        return {type(value).__name__: value.isoformat()}
    return by_value(value)[0]  # its natural literal is a string


def _restored(tagged: dict[str, str]) -> Any:
    ((kind, text),) = tagged.items()
    return _RESTORED[kind](text)
