"""A database in memory, of rows that nobody keeps."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import contextmanager

from sqlalchemy import Engine

from irtwin.storage import database as _database  # noqa: F401  it knows all tables of irtwin's own
from irtwin.storage.engine import open_engine, writing
from irtwin.storage.package_tables import package_tables
from irtwin.storage.rows import insert_rows
from irtwin.storage.schema import Base


@contextmanager
def in_memory(rows: Iterable[Base]) -> Iterator[Engine]:
    """Give a database with all tables of a workspace that holds these rows alone; it is gone afterwards."""
    package_tables()
    engine = open_engine("sqlite://")
    try:
        with writing(engine) as session:
            Base.metadata.create_all(session.connection())
            insert_rows(session, rows)
        yield engine
    finally:
        engine.dispose()
