"""The tables of an older workspace are brought up to date when it is opened, by Alembic, in one transaction.

A database says its revision in the table `alembic_version`.
"""

from __future__ import annotations

import re
from pathlib import Path

from sqlalchemy import Connection, Engine, inspect, text

from irtwin.errors import InputError
from irtwin.storage import engine as engines
from irtwin.storage.row_rules import check_rows

REVISIONS = Path(__file__).parent / "revisions"
VERSION_TABLE = "alembic_version"
_FILE = re.compile(r"r(\d{4})_\w+\.py")


def newest() -> str:
    """Return the revision that the tables of this irtwin have."""
    return max(known())


def known() -> set[str]:
    """Return all revisions that this irtwin knows."""
    return {match[1] for file in (REVISIONS / "versions").iterdir() if (match := _FILE.fullmatch(file.name))}


def revision(connection: Connection) -> str | None:
    """Return the revision that a database says, None where it says none."""
    if not inspect(connection).has_table(VERSION_TABLE):
        return None
    number = connection.execute(text(f"SELECT version_num FROM {VERSION_TABLE}")).scalar()
    return None if number is None else str(number)


def stamp(connection: Connection) -> None:
    """Say in a database whose tables were just made that they are of the newest revision."""
    if revision(connection) is not None:
        return  # another process made them at the same time
    connection.execute(text(f"CREATE TABLE {VERSION_TABLE} (version_num VARCHAR(32) NOT NULL PRIMARY KEY)"))
    connection.execute(text(f"INSERT INTO {VERSION_TABLE} VALUES (:revision)"), {"revision": newest()})


def migrate(engine: Engine) -> None:
    """Bring the tables of a database to the newest revision: all of it, or nothing where it fails or is killed.

    A copy of an SQLite file is kept beside it first. Raises InputError where a newer irtwin made the tables, or one
    before 0.2, or another program wrote what irtwin would not.
    """
    with engine.connect() as connection:
        current = revision(connection)
    if current == newest():
        return
    if current is None or current < min(known()):
        raise InputError(
            f"{engines.shown(engine.url)}: its tables are of an irtwin before 0.2; run its data sets into a new "
            "workspace"
        )
    if current not in known():
        raise InputError(
            f"{engines.shown(engine.url)}: its tables are of revision {current}, this irtwin knows none after "
            f"{newest()}; install the irtwin that made them, or a newer one"
        )
    if engines.is_read_only(engine):
        raise InputError(
            f"{engine.url.database}: its tables are of an older irtwin, and this user may only read it: "
            "who may write it brings them up to date by `irtwin workspace status`"
        )
    _keep_copy(engine, current)
    with engines.writing(engine, restructuring=True) as session:
        connection = session.connection()
        if revision(connection) == current:  # else another process has done it meanwhile
            _run(connection)
            check_rows(connection, engines.shown(engine.url))


def _keep_copy(engine: Engine, current: str) -> None:
    """Copy an SQLite file. A server's database has its own backups, and undoes the transaction too."""
    if engine.dialect.name != "sqlite" or not engine.url.database:
        return
    copy = Path(f"{engine.url.database}.{current}")
    if not copy.exists():  # else a migration was cut off, and what it began with is kept already
        part = copy.with_name(f"{copy.name}.part")
        part.unlink(missing_ok=True)
        with engine.connect() as connection:
            driver = connection.connection.driver_connection
            assert driver is not None
            driver.execute("VACUUM INTO ?", (str(part),))
        part.replace(copy)


def _run(connection: Connection) -> None:
    from alembic.config import Config  # only where there is something to do
    from alembic.runtime.environment import EnvironmentContext
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", str(REVISIONS))
    script = ScriptDirectory.from_config(config)
    steps = EnvironmentContext(
        config, script, fn=lambda current, context: script._upgrade_revs("head", current), as_sql=False
    )
    with steps:
        steps.configure(connection=connection, render_as_batch=True)
        steps.run_migrations()
