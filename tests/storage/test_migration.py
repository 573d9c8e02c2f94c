"""An older workspace is migrated when it is opened: whole, or not at all."""

from __future__ import annotations

import hashlib
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from importlib import import_module
from pathlib import Path

import pytest
from alembic.migration import MigrationContext
from alembic.operations import Operations
from sqlalchemy import create_engine, inspect, text
from tests.rows import data_set

from irtwin.errors import InputError
from irtwin.storage import engine as engines
from irtwin.storage import migration
from irtwin.storage.database import Workspace
from irtwin.storage.revisions.versions import r0021_tables_of_0_2 as first
from irtwin.storage.revisions.versions import r0022_no_yardstick as second
from irtwin.storage.revisions.versions import r0023_saving_verification as third
from irtwin.storage.revisions.versions import r0024_odd_stretches as fourth
from irtwin.storage.revisions.versions import r0025_mended_in_logs as fifth
from irtwin.storage.revisions.versions import r0026_friction_spread as sixth
from irtwin.storage.schema import Base

BEFORE = migration.newest()
# As a later irtwin would have it: runs have got the column `sample_rate_hz`.
LATER = f"""
import os
import sqlalchemy as sa
from alembic import op

revision, down_revision = "{int(BEFORE) + 1:04}", "{BEFORE}"


def upgrade():
    recreate = "always" if op.get_bind().dialect.name == "sqlite" else "never"  # as for what SQLite cannot alter
    with op.batch_alter_table("run", recreate=recreate) as run:
        run.add_column(sa.Column("sample_rate_hz", sa.Float(), nullable=True))
    op.execute("UPDATE run SET sample_rate_hz = 250.0")
    if "KILLED" in os.environ:
        os._exit(9)
"""
OPEN = """
import sys
from pathlib import Path
from irtwin.storage import migration
from irtwin.storage.database import Workspace

migration.REVISIONS = Path(sys.argv[1])
Workspace(Path(sys.argv[2])).close()
"""


def digest() -> str:
    """Return what changes whenever a column does."""
    columns = [
        f"{table.name}.{column.name} {column.type} {column.nullable} {sorted(map(str, column.foreign_keys))}"
        for table in Base.metadata.sorted_tables
        for column in table.columns
    ]
    return hashlib.sha256("\n".join(sorted(columns)).encode()).hexdigest()[:16]


def older(place: Workspace) -> None:
    """Ingest a data set, and make the tables those before LATER."""
    place.ingest(*data_set())
    recreate = "always" if place.engine.dialect.name == "sqlite" else "never"
    with engines.writing(place.engine, restructuring=True) as session:
        connection = session.connection()
        operations = Operations(MigrationContext.configure(connection))
        with operations.batch_alter_table("run", recreate=recreate) as run:
            run.drop_column("sample_rate_hz")
        connection.execute(text("UPDATE alembic_version SET version_num = :before"), {"before": BEFORE})


def columns(place: Workspace) -> set[str]:
    return {column["name"] for column in inspect(place.engine).get_columns("run")}


@pytest.fixture
def later(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    folder = tmp_path / "revisions"
    shutil.copytree(migration.REVISIONS, folder, ignore=shutil.ignore_patterns("__pycache__"))
    (folder / "versions" / f"r{int(BEFORE) + 1:04}_rates.py").write_text(LATER, encoding="utf-8")
    monkeypatch.setattr(migration, "REVISIONS", folder)
    return folder


def test_the_newest_revision_is_of_these_tables() -> None:
    (file,) = (migration.REVISIONS / "versions").glob(f"r{migration.newest()}_*.py")
    module = import_module(f"irtwin.storage.revisions.versions.{file.stem}")
    assert digest() == module.TABLES, f"the tables changed: write a revision with TABLES = {digest()!r}"


def test_a_new_workspace_says_the_newest_revision(tmp_path: Path) -> None:
    with Workspace(tmp_path) as place, place.engine.connect() as connection:
        assert migration.revision(connection) == migration.newest()


def test_an_older_workspace_is_migrated(database_url: str | None, tmp_path: Path, later: Path) -> None:
    with Workspace(tmp_path / "place", database_url) as place:
        older(place)
    with Workspace(tmp_path / "place", database_url) as place, place.engine.connect() as connection:
        assert migration.revision(connection) == migration.newest()
        assert set(connection.execute(text("SELECT sample_rate_hz FROM run")).scalars()) == {250.0}
        assert connection.execute(text("SELECT count(*) FROM series")).scalar()  # which refer to runs
        assert connection.execute(text("SELECT count(*) FROM run")).scalar() == len(data_set()[2])
    assert (tmp_path / "place" / f"irtwin.db.{BEFORE}").is_file() is (database_url is None)


def test_rows_that_another_program_wrote_are_not_migrated(tmp_path: Path, later: Path) -> None:
    with Workspace(tmp_path / "place") as place:
        older(place)
        with place.engine.begin() as connection:
            connection.execute(text("UPDATE joint SET lower_limit_rad = 'low' WHERE name = 'joint_a1'"))
    with pytest.raises(InputError, match="a row of table joint was changed by another program: lower_limit_rad 'low'"):
        Workspace(tmp_path / "place")
    with create_engine(f"sqlite:///{tmp_path / 'place/irtwin.db'}").connect() as connection:
        assert migration.revision(connection) == BEFORE


@pytest.mark.slow
def test_killed_in_the_middle_it_leaves_the_old_tables(tmp_path: Path, later: Path) -> None:
    with Workspace(tmp_path / "place") as place:
        older(place)
        command = [sys.executable, "-c", OPEN, later, tmp_path / "place"]
        assert subprocess.run(command, env={**os.environ, "KILLED": "yes"}, check=False).returncode == 9
        assert "sample_rate_hz" not in columns(place)
        with place.engine.connect() as connection:
            assert migration.revision(connection) == BEFORE
    with Workspace(tmp_path / "place") as place:
        assert "sample_rate_hz" in columns(place)


@pytest.mark.nightly
def test_killed_ten_times_at_any_moment_it_leaves_old_or_new_tables(tmp_path: Path, later: Path) -> None:
    with Workspace(tmp_path / "old") as place:
        older(place)
        before = columns(place)
    moments, command = random.Random(3), [sys.executable, "-c", OPEN, later, tmp_path / "place"]
    shutil.copytree(tmp_path / "old", tmp_path / "place")
    began = time.perf_counter()
    assert subprocess.run(command, check=False).returncode == 0
    length, killed = time.perf_counter() - began, 0
    with Workspace(tmp_path / "place") as place:
        after, rows = columns(place), said(place)
    for _ in range(10):
        shutil.rmtree(tmp_path / "place")
        shutil.copytree(tmp_path / "old", tmp_path / "place")
        with subprocess.Popen(command) as process:
            try:
                process.wait(moments.uniform(0.5, 1.0) * length)  # it imports for the first half
            except subprocess.TimeoutExpired:
                process.kill()
                killed += 1
        with closing(sqlite3.connect(tmp_path / "place/irtwin.db")) as connection:
            assert {row[1] for row in connection.execute("PRAGMA table_info(run)")} in (before, after)
        with Workspace(tmp_path / "place") as place:
            assert (columns(place), said(place)) == (after, rows)
    print(f"{killed} of 10 killed")


def said(place: Workspace) -> list[tuple[object, ...]]:
    with place.engine.connect() as connection:
        return [tuple(row) for row in connection.execute(text("SELECT * FROM run ORDER BY run_id"))]


def test_a_workspace_of_0_2_loses_what_is_told_no_more(tmp_path: Path) -> None:
    with Workspace(tmp_path) as place, place.engine.begin() as connection:
        connection.execute(text("CREATE TABLE gap_closeable (activity_id VARCHAR, closed FLOAT)"))
        for table in (third.TABLE, fourth.JOINTS, fourth.TABLE):
            connection.execute(text(f"DROP TABLE {table}"))
        for column in (fifth.COLUMN, *sixth.COLUMNS):
            connection.execute(text(f"ALTER TABLE {fifth.TABLE} DROP COLUMN {column}"))
        connection.execute(text(f"UPDATE alembic_version SET version_num = '{second.down_revision}'"))
    with Workspace(tmp_path) as place:
        assert not inspect(place.engine).has_table("gap_closeable")
        made = inspect(place.engine)
        assert all(made.has_table(table) for table in (third.TABLE, fourth.JOINTS, fourth.TABLE))
        assert {fifth.COLUMN, *sixth.COLUMNS} <= {column["name"] for column in made.get_columns(fifth.TABLE)}
        with place.engine.connect() as connection:
            assert migration.revision(connection) == migration.newest()


NEWER = "UPDATE alembic_version SET version_num = '9999'"
OLDER = f"UPDATE alembic_version SET version_num = '{int(first.revision) - 1:04}'"


@pytest.mark.parametrize(
    ("said", "why"),
    [
        (OLDER, r"before 0\.2; run its data sets into a new workspace"),
        ("DROP TABLE alembic_version", r"before 0\.2; run its data sets into a new workspace"),
        (NEWER, "its tables are of revision 9999, this irtwin knows none after"),
    ],
)
def test_a_workspace_before_0_2_or_of_a_newer_irtwin_is_refused(tmp_path: Path, said: str, why: str) -> None:
    with Workspace(tmp_path) as place, place.engine.begin() as connection:
        connection.execute(text(said))
    with pytest.raises(InputError, match=why):
        Workspace(tmp_path)
