"""From rows to quads, row by row (W3C R2RML, section 11.1)."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from pyoxigraph import Quad, RdfFormat, serialize
from sqlalchemy import Connection, Engine

from irtwin.errors import InputError
from irtwin.knowledge.mapping.plan import Statement, plan
from irtwin.knowledge.mapping.reader import read_document
from irtwin.knowledge.mapping.source import declarations, read, snapshot
from irtwin.knowledge.vocabulary import ID
from irtwin.storage import files
from irtwin.storage.engine import open_engine

_Planned = tuple[tuple[str, ...] | None, str | None, tuple[tuple[Path, bytes], ...]]  # tables, base IRI, documents

_KEPT: dict[_Planned, tuple[Statement, ...]] = {}


def map_database(
    engine: Engine, documents: Sequence[Path], base_iri: str | None = None, seconds: float = math.inf
) -> Iterator[Quad]:
    """Yield the quads that mapping documents make of a database, as one snapshot of it shows it.

    base_iri: what relative IRIs lie below; else what a document declares as @base, else that of the ontology;
    seconds: how long a triples map's SQL may take, with the mapping of its rows.
    The same quad may come more than once. Memory stays flat: rows are read in chunks.
    Raises InputError for a fault in a document, before the first quad, and for a row that does not fit it.
    """
    with planned(engine, documents, base_iri, seconds) as (connection, statements):
        for statement in statements:
            for rows in read(connection, statement.sql, statement.where):
                for row in rows:
                    yield from statement.quads(row)


@contextmanager
def planned(
    engine: Engine, documents: Sequence[Path], base_iri: str | None = None, seconds: float = math.inf
) -> Iterator[tuple[Connection, tuple[Statement, ...]]]:
    """Give a read-only snapshot of a database, and the statements that documents make of it."""
    with snapshot(engine, seconds) as connection:
        yield connection, _statements(connection, documents, base_iri)


def _statements(connection: Connection, documents: Sequence[Path], base_iri: str | None) -> tuple[Statement, ...]:
    """Return the statements of documents: those of before where neither the documents nor the tables changed."""
    tables = declarations(connection)
    known_by = (tables, base_iri, tuple((path, path.read_bytes() if path.is_file() else b"") for path in documents))
    if known_by in _KEPT:
        return _KEPT[known_by]
    checked = [read_document(path) for path in documents]
    made = tuple(
        statement
        for document in checked
        for statement in plan(connection, document, base_iri or document.base_iri or ID)
    )
    if tables is not None:
        _KEPT.clear()  # a process maps the same documents again and again
        _KEPT[known_by] = made
    return made


class RowMapper:
    """Mapping documents, ready for rows of the tables that they name by rr:tableName, for who watches these change.

    What a document reads by rr:sqlQuery or a join needs the database, and is left to `map_database`.
    """

    def __init__(self, engine: Engine, documents: Sequence[Path], base_iri: str | None = None) -> None:
        """Read the documents against a database. Raises InputError for a fault in one of them."""
        with planned(engine, documents, base_iri) as (_, statements):
            self._statements = [statement for statement in statements if statement.table]
        self._of_table: dict[str, list[Statement]] = {}  # as found

    def quads(self, table: str, rows: Iterable[Mapping[str, Any]]) -> Iterator[Quad]:
        """Yield what rows of a table become, values by column as the database's driver gives them.

        A column that a row lacks is NULL: it makes no quad. ValueError where no document names the table.
        """
        if table not in self._of_table:
            reads = (
                statement
                for statement in self._statements
                if statement.table[-1].find([table], folded=True) is not None
            )
            self._of_table[table] = list(reads)
        statements = self._of_table[table]
        if not statements:
            raise ValueError(f"no mapping document reads table {table!r} by its name")
        for row in rows:
            for statement in statements:
                yield from statement.quads([row.get(column) for column in statement.columns])


def map_to_file(
    mapping: Path, database_url: str, out: Path, base_iri: str | None = None, seconds: float = math.inf
) -> None:
    """Write the quads of one mapping document as N-Quads; the file is there whole or not at all.

    seconds: how long a triples map may take. Raises InputError as `map_database` does.
    """
    if out.is_dir() or not out.parent.is_dir():
        raise InputError(f"{out}: cannot be written; name a file in an existing folder")
    engine = open_engine(database_url, must_exist=True)
    try:
        with files.temporary_beside(out.parent) as temporary:
            serialize(map_database(engine, [mapping], base_iri, seconds), str(temporary), RdfFormat.N_QUADS)
            files.put_in_place(temporary, out)
    finally:
        engine.dispose()
