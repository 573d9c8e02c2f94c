"""An older workspace is migrated when it is opened: whole, or not at all."""

from __future__ import annotations

import hashlib
import json
import os
import random
import shutil
import sqlite3
import subprocess
import sys
import time
from contextlib import closing
from datetime import timedelta
from importlib import import_module
from pathlib import Path

import pytest
import sqlalchemy as sa
from alembic.migration import MigrationContext
from alembic.operations import Operations
from sqlalchemy import create_engine, insert, inspect, select, text
from tests.rows import activity, data_set

from irtwin.errors import InputError
from irtwin.providers.records import flat_notes
from irtwin.storage import engine as engines
from irtwin.storage import migration
from irtwin.storage.database import Workspace
from irtwin.storage.revisions.versions import (
    r0001_tables_of_0_1,
    r0002_base_of_individuals,
    r0003_made_and_slower,
    r0004_halves_of_the_time,
    r0005_units_and_relations,
    r0006_notes_of_robots,
    r0007_scale_of_torque,
    r0008_times_of_runs,
    r0009_no_consumption,
    r0010_log_odds,
    r0011_cutoff,
    r0012_one_criterion,
    r0013_choices,
    r0014_inseparable,
    r0015_supply_states,
    r0017_metered_loads,
    r0018_asserted_facts,
    r0019_simulators,
    r0020_no_notes,
    r0021_odds_after_an_experiment,
)
from irtwin.storage.rows import values
from irtwin.storage.schema import Activity, Base, Run

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


AFTER_0_1 = {  # columns that revisions have added
    "run": ("time_scaling_of", "time_scale", "product", "pieces", "cycles", "started", "ended"),
    "energy_share": ("lower_j", "upper_j", "inseparable"),
    "run_price": ("saving_j", "saving_lower_j", "saving_upper_j"),
    "robot": ("cutoff_hz",),
    "gap_diagnosis": ("unexplained_because", "cutoff_hz", "cutoff_why", "simulator_model"),
    "gap_cause_parameter": ("simulator_value", "robot_value"),
    "gap_cause": ("gain", "log_odds"),
    "gap_cause_competitor": ("probability",),
    "activity_use": ("relation",),
    "twin": ("torque_scale_uncertainty", "torque_scale_why", "cutoff_why"),
    "parameter": ("scaled_lower", "scaled_upper"),
    "base_parameter": ("scaled_lower", "scaled_upper"),
}
OF_0_1 = {  # columns that revisions have dropped, and whether they may be empty
    "gap_cause": {
        **{"gain_on_groups_left_out": False, "t_between_groups": False, "p_adjusted": False},
        **dict.fromkeys(r0012_one_criterion.APART, True),
    },
    "gap_cause_competitor": {"gain": True, "correlation": True},
    "gap_experiment_question": dict.fromkeys(r0021_odds_after_an_experiment.GONE, True),
}


def older(place: Workspace, *, of_0_1: bool = False) -> None:
    """Ingest a data set, and make the tables `aged`."""
    robot, joints, runs, series = data_set()
    place.ingest(robot, joints, runs, series)
    aged(place, of_0_1=of_0_1)


def aged(place: Workspace, *, of_0_1: bool) -> None:
    """Make the tables those before LATER; `of_0_1`: those of irtwin 0.1, in a database that says no revision."""
    recreate = "always" if place.engine.dialect.name == "sqlite" else "never"
    with engines.writing(place.engine, restructuring=True) as session:
        connection = session.connection()
        operations = Operations(MigrationContext.configure(connection))
        changed = {**dict.fromkeys(OF_0_1, ()), **AFTER_0_1} if of_0_1 else {"run": ("sample_rate_hz",)}
        for table, gone in changed.items():
            with operations.batch_alter_table(table, recreate=recreate) as of:
                for column in gone:
                    of.drop_column(column)
                for column, nullable in OF_0_1.get(table, {}).items():
                    of.add_column(sa.Column(column, sa.Float(), nullable=nullable))
        if of_0_1:
            connection.execute(text("DROP TABLE robot_note"))
            connection.execute(text("DROP TABLE twin_choice"))
            connection.execute(text("DROP TABLE inseparable_energy"))
            connection.execute(text("DROP TABLE supply_state"))
            connection.execute(text("DROP TABLE metered_load"))
            connection.execute(text("DROP TABLE asserted_fact"))
            connection.execute(text("DROP TABLE gap_horizon"))
            connection.execute(text("DROP TABLE individuals"))
            connection.execute(text("DROP TABLE alembic_version"))
        else:
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
    module = import_module(f"{r0001_tables_of_0_1.__package__}.{file.stem}")
    assert digest() == module.TABLES, f"the tables changed: write a revision with TABLES = {digest()!r}"


def test_each_revision_follows_another() -> None:
    assert r0003_made_and_slower.down_revision == r0002_base_of_individuals.revision
    assert r0004_halves_of_the_time.down_revision == r0003_made_and_slower.revision
    assert r0007_scale_of_torque.down_revision == r0006_notes_of_robots.revision
    assert r0008_times_of_runs.down_revision == r0007_scale_of_torque.revision
    assert r0009_no_consumption.down_revision == r0008_times_of_runs.revision
    assert r0010_log_odds.down_revision == r0009_no_consumption.revision
    assert r0011_cutoff.down_revision == r0010_log_odds.revision
    assert r0013_choices.down_revision == r0012_one_criterion.revision
    assert r0014_inseparable.down_revision == r0013_choices.revision
    assert r0015_supply_states.down_revision == r0014_inseparable.revision
    assert r0017_metered_loads.down_revision == r0015_supply_states.revision
    assert r0018_asserted_facts.down_revision == r0017_metered_loads.revision
    assert r0019_simulators.down_revision == r0018_asserted_facts.revision
    assert r0020_no_notes.down_revision == r0019_simulators.revision
    assert r0021_odds_after_an_experiment.down_revision == r0020_no_notes.revision


def test_a_new_workspace_says_the_newest_revision(tmp_path: Path) -> None:
    with Workspace(tmp_path) as place, place.engine.connect() as connection:
        assert migration.revision(connection) == migration.newest()


@pytest.mark.parametrize("on_server", [False, pytest.param(True, marks=pytest.mark.system)])
def test_an_older_workspace_is_migrated(
    on_server: bool, tmp_path: Path, later: Path, request: pytest.FixtureRequest
) -> None:
    url = request.getfixturevalue("new_postgresql_database")() if on_server else None
    with Workspace(tmp_path / "place", url) as place:
        older(place)
    with Workspace(tmp_path / "place", url) as place, place.engine.connect() as connection:
        assert migration.revision(connection) == migration.newest()
        assert set(connection.execute(text("SELECT sample_rate_hz FROM run")).scalars()) == {250.0}
        assert connection.execute(text("SELECT count(*) FROM series")).scalar()  # which refer to runs
        assert connection.execute(text("SELECT count(*) FROM run")).scalar() == len(data_set()[2])
    assert (tmp_path / "place" / f"irtwin.db.{BEFORE}").is_file() is not on_server


@pytest.mark.parametrize("on_server", [False, pytest.param(True, marks=pytest.mark.system)])
def test_a_workspace_of_0_1_gets_the_tables_of_now(
    on_server: bool, tmp_path: Path, request: pytest.FixtureRequest
) -> None:
    url = request.getfixturevalue("new_postgresql_database")() if on_server else None
    with Workspace(tmp_path / "place", url) as place:
        older(place, of_0_1=True)
        assert "product" not in columns(place)
    with Workspace(tmp_path / "place", url) as place, place.engine.connect() as connection:
        assert migration.revision(connection) == migration.newest()
        for table in Base.metadata.sorted_tables:
            made = {column["name"]: column["nullable"] for column in inspect(connection).get_columns(table.name)}
            assert made == {column.name: column.nullable for column in table.columns}, table.name
        keys = {one["constrained_columns"][0] for one in inspect(connection).get_foreign_keys("run")}
        assert keys == {"robot_id", "repeat_of", "performs", "time_scaling_of"}
        assert connection.execute(text("SELECT count(*) FROM run")).scalar() == len(data_set()[2])
        of_runs = connection.execute(select(Run.started, Run.ended, Run.start_time, Run.run_time_s)).all()
        assert [run[:2] for run in of_runs] == [(start, start + timedelta(seconds=s)) for *_, start, s in of_runs]


def test_rows_that_another_program_wrote_are_not_migrated(tmp_path: Path) -> None:
    with Workspace(tmp_path) as place:
        older(place, of_0_1=True)
        with place.engine.begin() as connection:
            connection.execute(text("UPDATE joint SET lower_limit_rad = 'low' WHERE name = 'joint_a1'"))
    with pytest.raises(InputError, match="a row of table joint was changed by another program: lower_limit_rad 'low'"):
        Workspace(tmp_path)
    with create_engine(f"sqlite:///{tmp_path / 'irtwin.db'}").connect() as connection:
        assert migration.revision(connection) != migration.newest()


def test_activities_of_an_older_workspace_name_individuals_below_its_base(tmp_path: Path) -> None:
    used = f"{r0002_base_of_individuals.BASE}run/Arm_A.fit_1"
    with Workspace(tmp_path) as place:
        older(place, of_0_1=True)
        with place.engine.begin() as connection:
            about = values(activity("a.1", "run_state", used))
            connection.execute(insert(Activity).values(about))
            for entity in (used, "https://plant.example/x"):
                connection.execute(text("INSERT INTO activity_use VALUES ('a.1', :entity)"), {"entity": entity})
    with Workspace(tmp_path) as place, place.engine.connect() as connection:
        assert connection.execute(text("SELECT subject FROM activity")).scalars().all() == ["run/Arm_A.fit_1"]
        found = connection.execute(text("SELECT entity FROM activity_use")).scalars()
        assert set(found) == {"run/Arm_A.fit_1", "https://plant.example/x"}


def test_units_of_live_gaps_and_relations_of_uses_are_written() -> None:
    with create_engine("sqlite://").begin() as connection:
        for table in ("gap_state", "gap_excursion"):
            connection.execute(text(f"CREATE TABLE {table} (unit VARCHAR)"))
            connection.execute(text(f"INSERT INTO {table} VALUES ('N m'), ('N'), ('W')"))
        connection.execute(text("CREATE TABLE activity_use (entity VARCHAR)"))
        connection.execute(text("INSERT INTO activity_use VALUES ('run/Arm_A.1'), ('twin/Arm_A.t1')"))
        with Operations.context(MigrationContext.configure(connection)):
            r0005_units_and_relations.upgrade()
        for table in ("gap_state", "gap_excursion"):
            assert connection.execute(text(f"SELECT unit FROM {table}")).scalars().all() == ["N-M", "N", "W"]
        uses = connection.execute(text("SELECT entity, relation FROM activity_use")).all()
        assert [*map(tuple, uses)] == [("run/Arm_A.1", "wasInformedBy"), ("twin/Arm_A.t1", "used")]


def test_notes_become_rows() -> None:
    said = '{"name": "Arm A", "location": "cell 4", "supply": {"voltage": 400}, "tools": ["gripper", "welder"]}'
    with create_engine("sqlite://").begin() as connection:
        connection.execute(text("CREATE TABLE robot (robot_id VARCHAR PRIMARY KEY, notes VARCHAR)"))
        connection.execute(text("INSERT INTO robot VALUES ('Arm_A', :said), ('Arm_B', '{}')"), {"said": said})
        with Operations.context(MigrationContext.configure(connection)):
            r0006_notes_of_robots.upgrade()
        found = connection.execute(text("SELECT * FROM robot_note")).all()
    expected = {(name, 1, value[0]) for name, value in flat_notes(json.loads(said)).items() if name != "name"}
    expected.add(("tools", 2, "welder"))
    assert {tuple(row) for row in found} == {("Arm_A", *row) for row in expected}
    assert ("supply.voltage", 1, "400") in expected


def test_what_a_simulator_wrote_loses_its_consumption() -> None:
    with create_engine("sqlite://").begin() as connection:
        connection.execute(text("CREATE TABLE run (run_id VARCHAR, role VARCHAR)"))
        connection.execute(text("INSERT INTO run VALUES ('Arm_A.1', 'observed'), ('Arm_A.2', 'simulated')"))
        connection.execute(text("CREATE TABLE run_energy (run_id VARCHAR, energy_consumption_j FLOAT NOT NULL)"))
        connection.execute(text("INSERT INTO run_energy VALUES ('Arm_A.1', 5.0), ('Arm_A.2', 7.0)"))
        with Operations.context(MigrationContext.configure(connection)):
            r0009_no_consumption.upgrade()
        found = connection.execute(text("SELECT run_id, energy_consumption_j FROM run_energy ORDER BY run_id")).all()
        assert [*map(tuple, found)] == [("Arm_A.1", 5.0), ("Arm_A.2", None)]


def test_causes_of_an_earlier_criterion_keep_their_gain_and_have_no_log_odds() -> None:
    judged = ("t_between_groups", "p_adjusted", "p_remembered", "part_that_repeats")
    with create_engine("sqlite://").begin() as connection:
        told = ", ".join(f"{name} FLOAT" for name in judged)
        connection.execute(
            text(
                "CREATE TABLE gap_cause (cause_id VARCHAR PRIMARY KEY, confidence FLOAT, gain_on_groups_left_out FLOAT "
                f"NOT NULL, {told}, first_half_shows_it BOOLEAN, last_half_shows_it BOOLEAN)"
            )
        )
        connection.execute(text("INSERT INTO gap_cause VALUES ('payload', 0.9, 2.5, 7.0, 0.01, NULL, NULL, 1, 0)"))
        connection.execute(text("CREATE TABLE gap_cause_competitor (effect VARCHAR, gain FLOAT, correlation FLOAT)"))
        connection.execute(text("INSERT INTO gap_cause_competitor VALUES ('backlash', 1.5, 0.8)"))
        with Operations.context(MigrationContext.configure(connection)):
            r0010_log_odds.upgrade()
        (cause,) = connection.execute(text("SELECT * FROM gap_cause")).mappings()
        assert cause == {"cause_id": "payload", "confidence": 0.9, "gain": 2.5, "log_odds": None}
        rivals = {column["name"] for column in inspect(connection).get_columns("gap_cause_competitor")}
        assert rivals == {"effect", "probability"}
        assert connection.execute(text("SELECT count(*) FROM gap_cause_competitor")).scalar() == 0


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


def test_triggers_that_noted_changes_go(tmp_path: Path) -> None:
    with Workspace(tmp_path) as place, place.engine.begin() as connection:
        connection.execute(text("CREATE TABLE row_change (number INTEGER PRIMARY KEY, table_name TEXT)"))
        note = "INSERT INTO row_change (table_name) VALUES ('run')"
        connection.execute(text(f"CREATE TRIGGER irtwin_noted_run_insert AFTER INSERT ON run BEGIN {note}; END"))
        for column in r0021_odds_after_an_experiment.GONE:
            connection.execute(text(f"ALTER TABLE gap_experiment_question ADD COLUMN {column} FLOAT"))
        connection.execute(text("UPDATE alembic_version SET version_num = '0019'"))
    with Workspace(tmp_path) as place, place.engine.connect() as connection:
        assert connection.execute(text("SELECT name FROM sqlite_master WHERE type = 'trigger'")).all() == []
        assert not inspect(connection).has_table("row_change")


def test_a_workspace_of_a_newer_irtwin_is_refused(tmp_path: Path) -> None:
    with Workspace(tmp_path) as place, place.engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
    with pytest.raises(InputError, match="its tables are of revision 9999, this irtwin knows none after"):
        Workspace(tmp_path)
