"""How a database is opened, and how its writers take turns."""

from __future__ import annotations

import math
import sqlite3
import time
from collections.abc import Callable, Container, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event, inspect, make_url, text
from sqlalchemy.engine import URL, ExceptionContext
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, OperationalError
from sqlalchemy.orm import Session

from irtwin.errors import InputError, WorkspaceFault
from irtwin.storage.read_only import connecting, may_only_be_read

_LONGEST_VALUE = 100_000_000  # bytes of one text or blob in SQLite, so that no query fills the memory by one
MOST_LOOKED_THROUGH = 100_000_000  # bytes of an SQLite database at opening: some 0.2 s
_DAMAGE = ("malformed", "not a database")
_NO_UTF8 = ("ould not decode to UTF-8", "codec can't decode")  # SQLite's words of a value, Python's of a name
_SECRETS = ("pass", "token", "secret", "key")  # in names of parameters whose values are not shown
_FULL = ("is full", "disk I/O error")
_OF_SERVER = {  # by the beginning of PostgreSQL's state
    "42501": "this user may not do that; ask who runs the server for the right",
    "25006": "the server takes no changes now; try again later",
    "53": "the server is out of memory, disk or connections; ask who runs it",
}
TO_WRITE = "ask its owner for the right, or work on a copy, by `irtwin workspace backup` and `irtwin workspace restore`"
BUSY_TIMEOUT = 30.0  # s that a writer waits for another one
_NO_LOCK = "55P03"  # PostgreSQL's state of a lock that was not had in time
_WRITER_LOCK = 0x697274776E  # "irtwn": the advisory lock that writers hold on PostgreSQL


def open_engine(url: str | URL, must_exist: bool = False) -> Engine:
    """Open a database that any SQLAlchemy URL names.

    Raises InputError, which never shows the password, where the URL, its driver or the server fails;
    with `must_exist`, also where an SQLite file is not there (SQLite would make an empty one).
    """
    address = _address(url)
    if must_exist and address.get_backend_name() == "sqlite" and not Path(address.database or "").is_file():
        raise InputError(f"{address.database}: there is no such SQLite database; give the path of an existing one")
    try:
        engine = create_engine(address, **_reading(address))
    except (ModuleNotFoundError, NoSuchModuleError) as error:
        raise InputError(
            f"{shown(address)}: no driver for this database ({error}); for PostgreSQL install irtwin[postgresql]"
        ) from None
    if engine.dialect.name == "sqlite":
        event.listen(engine, "connect", _prepare_sqlite)
        event.listen(engine, "begin", _begin_sqlite)
        event.listen(engine, "handle_error", lambda context: _tell(address, context.original_exception))
    if engine.dialect.name == "postgresql":
        event.listen(engine, "handle_error", lambda context: _tell_of_server(address, context))
    try:
        with engine.connect() as connection:
            if engine.dialect.name == "sqlite":
                connection.exec_driver_sql("PRAGMA schema_version")  # SQLite reads the file only now
    except DBAPIError as error:
        reason = " ".join(str(error.orig).split())
        raise WorkspaceFault(f"{shown(address)}: cannot open the database: {reason}") from None
    return engine


def _reading(address: URL) -> dict[str, Any]:
    """Return how an SQLite database is opened that this user may only read; nothing of any other."""
    file = Path(address.database or "")
    if address.get_backend_name() != "sqlite" or not may_only_be_read(file):
        return {}
    return {"creator": connecting(file), "execution_options": {"read_only": True}}


def is_read_only(engine: Engine) -> bool:
    """Whether this user may only read the database: known of SQLite alone."""
    return bool(engine.get_execution_options().get("read_only", False))


def shown(url: URL) -> str:
    """Return a URL as messages may show it: without a password, which may stand among its parameters too."""
    secret = {name: "***" for name in url.query if any(word in name.lower() for word in _SECRETS)}
    return url.update_query_dict(secret).render_as_string(hide_password=True)


def columns(engine: Engine) -> dict[str, set[str]]:
    """Return the names of each table's columns."""
    with engine.connect() as connection:
        if engine.dialect.name != "sqlite":
            of_each = inspect(connection).get_multi_columns()
            return {table: {column["name"] for column in columns} for (_, table), columns in of_each.items()}
        names: dict[str, set[str]] = {}  # by one question: reflection asks SQLite table by table
        for table, column in connection.exec_driver_sql(
            "SELECT t.name, c.name FROM sqlite_master AS t, pragma_table_xinfo(t.name) AS c WHERE t.type = 'table'"
        ):
            names.setdefault(table, set()).add(column)
        return names


@contextmanager
def writing(engine: Engine, restructuring: bool = False) -> Iterator[Session]:
    """Give a session that is the only writer, in one transaction, committed at the end.

    `restructuring`: SQLite changes a table by making another in its place; what refers to it is looked at afterwards.
    Raises WorkspaceFault where another writer holds the database for longer than BUSY_TIMEOUT, or this user may not
    write.
    """
    if is_read_only(engine):
        raise WorkspaceFault(f"{engine.url.database}: cannot be written, as this user may only read it: {TO_WRITE}")
    with engine.connect().execution_options(writes=True) as connection, ExitStack() as after:
        driver = connection.connection.driver_connection
        if restructuring and isinstance(driver, sqlite3.Connection):  # it can be told so outside a transaction alone
            driver.execute("PRAGMA foreign_keys = OFF")
            after.callback(driver.execute, "PRAGMA foreign_keys = ON")
        with _turn(connection), Session(connection) as session:
            yield session
            session.flush()
            if restructuring and engine.dialect.name == "sqlite":
                broken = connection.exec_driver_sql("PRAGMA foreign_key_check").first()
                if broken is not None:
                    raise RuntimeError(f"rows of table {broken[0]} refer to rows of {broken[2]} that are gone")


@contextmanager
def before_writing(engine: Engine, do: Callable[[], None]) -> Iterator[None]:
    """Have something done before rows change, within the turn of each writer by this engine."""

    def begun(connection: Connection) -> None:
        if _writes(connection):
            do()

    event.listen(engine, "begin", begun)
    try:
        yield
    finally:
        event.remove(engine, "begin", begun)


@contextmanager
def _turn(connection: Connection) -> Iterator[None]:
    """Begin a transaction once nobody else writes, and commit it. WorkspaceFault where that takes too long."""
    with ExitStack() as held:
        try:
            held.enter_context(connection.begin())
            if connection.dialect.name == "postgresql":
                connection.execute(text(f"SET LOCAL lock_timeout = {int(BUSY_TIMEOUT * 1000)}"))
                connection.execute(text("SELECT pg_advisory_xact_lock(:key)"), {"key": _WRITER_LOCK})
                connection.execute(text("SET LOCAL lock_timeout TO DEFAULT"))
        except OperationalError as error:
            if not _locked(error):
                raise
            raise WorkspaceFault(
                f"{shown(connection.engine.url)}: another process has been writing for {BUSY_TIMEOUT:g} s; "
                "try again later"
            ) from None
        yield


def use_write_ahead_log(engine: Engine) -> None:
    """Let an SQLite database's readers go on while one writes; kept in the file, other databases do so anyway."""
    if engine.dialect.name != "sqlite" or is_read_only(engine):
        return
    deadline = time.monotonic() + BUSY_TIMEOUT
    while True:
        with engine.connect() as connection:
            driver = connection.connection.driver_connection
            assert isinstance(driver, sqlite3.Connection)
            try:
                driver.execute("PRAGMA journal_mode = WAL")
                return
            except sqlite3.DatabaseError as error:
                _tell(engine.url, error)
                # SQLite does not wait here by itself while another process makes the same change.
                if "locked" not in str(error) or time.monotonic() > deadline:
                    raise
        time.sleep(0.05)


def check(engine: Engine, most_bytes: float = MOST_LOOKED_THROUGH) -> float:
    """Look through an SQLite database that is not larger; return its bytes, infinite where no SQLite keeps it.

    Raises WorkspaceFault where it is damaged.
    """
    if engine.dialect.name != "sqlite":
        return math.inf
    with engine.connect() as connection:
        size = connection.exec_driver_sql(
            "SELECT page_count * page_size FROM pragma_page_count, pragma_page_size"
        ).scalar_one()
        if size > most_bytes:
            return float(size)
        answer = connection.exec_driver_sql("PRAGMA quick_check(1)").scalar()
    if answer != "ok":
        raise WorkspaceFault(_damaged(engine.url, " ".join(str(answer).split())))
    return float(size)


def check_schema(engine: Engine, tables: Container[str]) -> None:
    """Raise WorkspaceFault where an SQLite database has a view in place of a table, or another's trigger on one.

    Each is a query of somebody else's, which runs whenever the table is read or written, and may never end.
    """
    if engine.dialect.name != "sqlite":
        return
    with engine.connect() as connection:
        objects = connection.exec_driver_sql(
            "SELECT type, name, tbl_name FROM sqlite_master WHERE type IN ('view', 'trigger')"
        ).all()
    for kind, name, table in objects:
        if table in tables:
            raise WorkspaceFault(
                f"{engine.url.database}: holds the {kind} {name!r}, which irtwin did not make; drop it, or restore a "
                "backup by `irtwin workspace restore ARCHIVE --workspace NEW`"
            )


def _tell(url: URL, error: BaseException) -> None:
    """Raise WorkspaceFault for what SQLite says of a damaged file or a full disk."""
    reason = " ".join(str(error).split())
    if any(text in reason for text in _NO_UTF8):
        raise WorkspaceFault(
            f"{url.database}: holds text that is not UTF-8 ({reason[:160]}); mend it with what wrote it, or "
            "restore a backup by `irtwin workspace restore ARCHIVE --workspace NEW`"
        ) from error
    if any(text in reason for text in _DAMAGE):
        raise WorkspaceFault(_damaged(url, reason)) from error
    if any(text in reason for text in _FULL):
        raise WorkspaceFault(
            f"{url.database}: cannot be written ({reason}); free some space; nothing was changed"
        ) from error


def _tell_of_server(url: URL, context: ExceptionContext) -> None:
    """Raise WorkspaceFault for what those who run a PostgreSQL server can mend."""
    error = context.original_exception
    state = str(getattr(error, "sqlstate", None) or "")
    problem = next(
        (f"{meaning}; nothing was changed" for code, meaning in _OF_SERVER.items() if state.startswith(code)), None
    )
    if context.is_disconnect and context.connection is not None:
        problem = "the connection to the database was lost; do it again"
    if problem is not None:
        raise WorkspaceFault(f"{shown(url)}: {problem} ({' '.join(str(error).split())[:160]})") from error


def _damaged(url: URL, reason: str) -> str:
    return (
        f"{url.database}: the database is damaged ({reason[:160]}); `irtwin workspace restore ARCHIVE --workspace NEW` "
        "makes another of a backup; without one, run the data sets again into a new workspace"
    )


def _address(url: str | URL) -> URL:
    try:
        address = make_url(url)
    except ArgumentError:
        raise InputError(
            "the database URL cannot be read; write it like sqlite:///irtwin.db or postgresql://user@host/name"
        ) from None
    if address.drivername in ("postgresql", "postgres"):
        address = address.set(drivername="postgresql+psycopg")
    return address


def _prepare_sqlite(connection: sqlite3.Connection, _record: Any) -> None:
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, _LONGEST_VALUE)
    connection.isolation_level = None  # transactions begin where _begin_sqlite says
    connection.execute(f"PRAGMA busy_timeout = {int(BUSY_TIMEOUT * 1000)}")
    connection.execute("PRAGMA foreign_keys = ON")


def _begin_sqlite(connection: Connection) -> None:
    # A writer that begins as a reader could find, too late, that another one wrote meanwhile.
    connection.exec_driver_sql("BEGIN IMMEDIATE" if _writes(connection) else "BEGIN")


def _writes(connection: Connection) -> bool:
    return bool(connection.get_execution_options().get("writes", False))


def _locked(error: OperationalError) -> bool:
    in_sqlite = isinstance(error.orig, sqlite3.OperationalError) and "locked" in str(error.orig)
    return in_sqlite or getattr(error.orig, "sqlstate", None) == _NO_LOCK
