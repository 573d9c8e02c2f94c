"""Mapping anew only what changed: rows that are new or gone since the last run, on any database.

All rows are read, and told from the remembered ones by a hash. A quad of a row that is gone goes too, unless another
row makes it: rows of the same subject are looked up among the remembered ones.
"""

from __future__ import annotations

import hashlib
import marshal
import math
import sqlite3
import uuid
from collections.abc import Iterable, Iterator, Sequence
from importlib import metadata
from itertools import chain
from pathlib import Path

import numpy as np
import numpy.typing as npt
from pyoxigraph import Literal, NamedNode, Quad
from sqlalchemy import Connection, Engine

from irtwin.errors import InputError
from irtwin.knowledge.garbage import seldom_collected
from irtwin.knowledge.mapping.plan import Statement
from irtwin.knowledge.mapping.processor import planned
from irtwin.knowledge.mapping.remembered import ENTRY, DamagedRows, Entries, RememberedRows
from irtwin.knowledge.mapping.source import declarations, read
from irtwin.knowledge.mapping.terms import Row
from irtwin.knowledge.store.blank_nodes import has_blank_node
from irtwin.knowledge.store.graph import URI_SPACE, KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_MAPPED, GRAPH_SOURCE, ID, OWL

_MAPPED = (GRAPH_SOURCE, GRAPH_ACTIVITY)
_ASK_VERSION = f"SELECT ?version {{ GRAPH <{GRAPH_MAPPED}> {{ ?graphs owl:versionInfo ?version }} }}"


@seldom_collected()
def refresh(
    graph: KnowledgeGraph, engine: Engine, documents: Sequence[Path], file: Path, seconds: float = math.inf
) -> None:
    """Bring the graphs of sources and activities up to date with a database.

    file: where the rows are remembered; seconds: how long a triples map's SQL may take. The graph names the state that
    they are of, so that a graph or a file that was put back, or a crash between the two, leads to a full run, as
    another document, table or software does.
    Raises InputError as `map_database`; graph and file then stay as they were.
    """
    try:
        _refresh(graph, engine, documents, file, seconds)
    except (DamagedRows, sqlite3.DatabaseError) as error:
        if isinstance(error, sqlite3.OperationalError) and "no such" not in str(error):
            raise InputError(f"{file}: cannot be written: {error}") from error
        file.unlink()  # what it remembers can be had from the database
        _refresh(graph, engine, documents, file, seconds)


def _refresh(graph: KnowledgeGraph, engine: Engine, documents: Sequence[Path], file: Path, seconds: float) -> None:
    with (
        planned(engine, documents, graph.base, seconds) as (connection, statements),
        RememberedRows(file) as remembered,
    ):
        parts = (
            metadata.version("irtwin"),
            *(declarations(connection) or ()),  # a column's type decides on its literals
            graph.base,
            *(path.read_text(encoding="utf-8") for path in documents),
            *(statement.sql for statement in statements),
        )
        made_by = hashlib.sha256("\0".join(parts).encode()).hexdigest()
        current = next((row["version"] for row in graph.query(_ASK_VERSION)), "")
        version = f"{made_by}.{uuid.uuid4().hex}"
        if current == remembered.version and current.startswith(made_by):
            removed, added = _Run(connection, statements, remembered).changes()
            if not has_blank_node(added | removed):
                if added or removed:
                    graph.change({*removed, _version(current)}, {*added, _version(version)})
                    remembered.version = version
                return
        remembered.forget()
        run = _Run(connection, statements, remembered)
        base = [] if graph.base == ID else [_said(URI_SPACE, graph.base)]  # readers would take another
        graph.replace(chain(run.added(), [_version(version)], base), *_MAPPED)
        remembered.version = version


class _Run:
    """One look at all rows, beside those that are remembered."""

    def __init__(self, connection: Connection, statements: Sequence[Statement], remembered: RememberedRows) -> None:
        self.connection = connection
        self.statements = statements
        self.remembered = remembered
        self.gone: dict[int, Entries] = {}  # by the statement's number

    def added(self) -> Iterator[Quad]:
        """Yield the quads of rows that are not remembered, and remember those."""
        for number, statement in enumerate(self.statements):
            yield from self._added(number, statement)

    def _added(self, number: int, statement: Statement) -> Iterator[Quad]:
        entries = self.remembered.entries(number)
        seen = np.zeros(len(entries), dtype=bool)
        new: list[Entries] = []
        for rows in read(self.connection, statement.sql, statement.where):
            unknown = _unknown(rows, entries, seen)
            made = [statement.quads(row) for row in unknown.values()]
            if made:
                subjects = _hashes(str(quads[0].subject if quads else None) for quads in made)
                ids = self.remembered.keep(list(unknown.values()))
                new.append(np.array(list(zip(unknown, subjects, ids, strict=True)), ENTRY))
                yield from chain.from_iterable(made)
        self.gone[number] = entries[~seen]
        if new or not seen.all():
            self.remembered.set_entries(number, np.concatenate([entries[seen], *new]))

    def changes(self) -> tuple[set[Quad], set[Quad]]:
        """Return the quads that no row makes any more, and those that new rows make; forget the rows that are gone."""
        added = set(self.added())
        gone = {
            quad
            for number, entries in self.gone.items()
            for row in self.remembered.rows(entries)
            for quad in self.statements[number].quads(row)
        }
        for entries in self.gone.values():
            self.remembered.drop(entries)
        return self._no_longer_made(gone - added), added - gone

    def _no_longer_made(self, candidates: set[Quad]) -> set[Quad]:
        subjects = _hashes({str(quad.subject) for quad in candidates})
        for number, statement in enumerate(self.statements):
            entries = self.remembered.entries(number)
            for row in self.remembered.rows(entries[np.isin(entries["subject"], subjects)]):
                candidates.difference_update(statement.quads(row))
        return candidates


def _unknown(rows: Sequence[Row], entries: Entries, seen: npt.NDArray[np.bool_]) -> dict[int, Row]:
    """Return the rows that have no entry, by hash; mark in `seen`, (N,), the entries of the others."""
    hashes = np.frombuffer(b"".join(map(_row_hash, rows)), np.uint64)
    known = entries["row"]
    at = np.searchsorted(known, hashes)
    within = at < len(known)
    unknown = np.zeros(len(rows), dtype=bool)
    unknown[within] = known[at[within]] == hashes[within]
    seen[at[unknown]] = True
    return {int(hashes[index]): rows[index] for index in np.flatnonzero(~unknown).tolist()}


def _row_hash(row: Row) -> bytes:
    try:
        content = marshal.dumps(tuple(row), 2)  # without references, so that the value alone decides
    except ValueError:
        content = repr(tuple(row)).encode()
    return hashlib.blake2b(content, digest_size=8).digest()


def _hashes(texts: Iterable[str]) -> npt.NDArray[np.uint64]:
    digests = (hashlib.blake2b(text.encode(), digest_size=8).digest() for text in texts)
    return np.frombuffer(b"".join(digests), np.uint64)


def _version(name: str) -> Quad:
    return _said(f"{OWL}versionInfo", name)


def _said(property: str, value: str) -> Quad:
    return Quad(NamedNode(GRAPH_SOURCE), NamedNode(property), Literal(value), NamedNode(GRAPH_MAPPED))
