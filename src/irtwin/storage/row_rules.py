"""What a row may hold, by its column: the rules by which `ingest` makes rows, for those that come from elsewhere.

Rows of a backup and of an older workspace were written by nobody knows whom. Names in them become IRIs and files.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from datetime import datetime
from functools import cache
from typing import Any

from sqlalchemy import Column, Connection, Table, select

from irtwin.errors import InputError
from irtwin.storage.asserted import FILLED
from irtwin.storage.base_iri import checked as checked_base
from irtwin.storage.rows import FILES, filled
from irtwin.storage.schema import MEASURED, MEASURED_RUN, MODELLED, PLANNED, PLANNED_RUN, WATCHED_RUNS, Moment

_LONGEST = 20_000_000  # characters of a text: a URDF may have 10 MB
_MOST = 1 << 63  # beyond the whole numbers that databases hold
_NAME = r"[A-Za-z0-9_~-]{1,200}"
_PATTERNS = {
    "robot_id": re.compile(_NAME),
    "run_id": re.compile(rf"{_NAME}\.{_NAME}"),
    "twin_id": re.compile(rf"{_NAME}\.{_NAME}"),
    "series_id": re.compile(r"[0-9a-f]{64}"),
    "run.kind": re.compile("|".join((PLANNED_RUN, MEASURED_RUN, *WATCHED_RUNS))),
    "series.kind": re.compile("|".join((MEASURED, PLANNED, MODELLED))),
    "asserted_fact.place": re.compile("|".join(f"{table}[.]({'|'.join(names)})" for table, names in FILLED.items())),
    **dict.fromkeys(
        (f"asserted_fact.{name}" for name in ("subject", "predicate", "graph")),
        re.compile(r"[A-Za-z][A-Za-z0-9+.-]*:[^\x00-\x20<>\"{}|^`\\]*"),
    ),
}
_FILE = re.compile(r"[a-z]+/[A-Za-z0-9_~-][A-Za-z0-9_.~-]{0,250}")
_SHA256 = re.compile(r"[0-9a-f]{64}")


def check_row(table: Table, row: Mapping[str, Any]) -> None:
    """Raise ValueError, naming column and value, where a row of a table is none that irtwin writes."""
    for column, fits in _rules(table).items():
        if not fits(row[column]):
            raise ValueError(f"{column} {str(row[column])[:100]!r} is none that irtwin writes")
    if table.name == "run" and not row["run_id"].startswith(f"{row['robot_id']}."):
        raise ValueError(f"run_id {row['run_id']!r} is none of robot {row['robot_id']!r}")
    if table.name == "individuals":
        _check_base(row["base_iri"])


def check_rows(connection: Connection, where: str) -> None:
    """Raise InputError, which begins with `where`, for the first row of a database that irtwin would not write."""
    for table in filled(connection):
        try:
            for row in connection.execute(select(table).execution_options(yield_per=1000)).mappings():
                check_row(table, dict(row))
        except (ValueError, TypeError) as error:  # a type: a number where a moment is read from text
            raise _changed(where, table.name, str(error)) from None
    if connection.dialect.name == "sqlite":  # which another program may open without asking for foreign keys
        for name, _, parent, _ in connection.exec_driver_sql("PRAGMA foreign_key_check"):
            raise _changed(where, name, f"it refers to no row of {parent}")


def _changed(where: str, table: str, how: str) -> InputError:
    return InputError(f"{where}: a row of table {table} was changed by another program: {how}; restore a backup")


@cache
def _rules(table: Table) -> dict[str, Callable[[Any], bool]]:
    """Return, of each column, what tells whether a value may stand in it."""
    named = FILES.get(table.name, ())
    files = {file: _FILE for file, _ in named} | {checksum: _SHA256 for _, checksum in named}
    return {column.name: _rule(column, files.get(column.name) or _pattern(column)) for column in table.columns}


def _pattern(column: Column[Any]) -> re.Pattern[str] | None:
    """Return what a column's text must be, by the name of the column that it refers to in the end."""
    while column.foreign_keys:
        column = next(iter(column.foreign_keys)).column
    return _PATTERNS.get(str(column)) or _PATTERNS.get(column.name)


def _rule(column: Column[Any], pattern: re.Pattern[str] | None) -> Callable[[Any], bool]:
    kind = datetime if isinstance(column.type, Moment) else column.type.python_type

    def fits(value: Any) -> bool:
        if value is None:
            return bool(column.nullable)
        if kind is str:
            return isinstance(value, str) and _is_text(value) and (pattern is None or bool(pattern.fullmatch(value)))
        if kind is float:
            return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < math.inf
        if kind is int:
            return isinstance(value, int) and not isinstance(value, bool) and -_MOST <= value < _MOST
        return isinstance(value, kind)

    return fits


def _check_base(base: str) -> None:
    try:
        checked_base(base, "base_iri")
    except InputError as error:
        raise ValueError(str(error)) from None


def _is_text(value: str) -> bool:
    return len(value) <= _LONGEST and "\0" not in value and not re.search("[\ud800-\udfff]", value)
