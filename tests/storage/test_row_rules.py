"""Rows that another program changed are told before anything is made of them."""

from __future__ import annotations

import math
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import Table, insert
from tests import rows

from irtwin.errors import InputError
from irtwin.storage import engine
from irtwin.storage.database import Workspace
from irtwin.storage.row_rules import check_row
from irtwin.storage.rows import values
from irtwin.storage.schema import Base, Individuals, JointRow, RobotRow, RunRow, Series

SERIES = {
    "series_id": "a" * 64,
    "run_id": f"{rows.ROBOT}.work",
    "kind": "measured",
    "path": f"series/{'a' * 64}.parquet",
    "row_count": 5,
    "columns": "time",
    "activity_id": None,
}


def write(place: Path, *tables: type[Base]) -> None:
    """Make a workspace with a row of each table."""
    with Workspace(place) as workspace, engine.writing(workspace.engine) as session:
        for table in tables:
            session.execute(insert(of(table)), [row_of(table)])


def change(place: Path, words: str, *values: object) -> None:
    """Change its rows as another program does."""
    with closing(sqlite3.connect(place / "irtwin.db")) as database:
        database.execute(words, values) if values else database.executescript(words)
        database.commit()


def row_of(table: type[Base]) -> dict[str, Any]:
    if table is Series:
        return dict(SERIES)
    if table is Individuals:
        return {"base_iri": "https://plant.example/energy/"}
    return values({RobotRow: rows.robot, JointRow: lambda: rows.joints()[0], RunRow: lambda: rows.run("work")}[table]())


@pytest.mark.parametrize("table", [RobotRow, JointRow, RunRow, Series, Individuals])
def test_what_irtwin_writes_is_taken(table: type[Base]) -> None:
    check_row(of(table), row_of(table))


def test_names_of_any_script_are_taken() -> None:
    check_row(of(RobotRow), row_of(RobotRow) | {"robot_id": "~0123456789abcdef", "name": "焊接机器人"})


@pytest.mark.parametrize(
    ("table", "column", "value"),
    [
        (RobotRow, "robot_id", "../../../x"),
        (RobotRow, "robot_id", ""),
        (RobotRow, "robot_id", None),
        (RobotRow, "robot_id", "a/b"),
        (RobotRow, "robot_id", "a" * 300),
        (RobotRow, "robot_id", 5),
        (RobotRow, "name", "a\0b"),
        (RobotRow, "name", "\ud800"),
        (RobotRow, "controlled_axes", 10**30),
        (RobotRow, "controlled_axes", True),
        (RobotRow, "weight_kg", "50"),
        (RobotRow, "weight_kg", math.inf),
        (RobotRow, "simulated", "yes"),
        (JointRow, "robot_id", ".."),
        (RunRow, "run_id", f"{rows.ROBOT}/../x"),
        (RunRow, "run_id", "other.work"),
        (RunRow, "repeat_of", "../work"),
        (RunRow, "kind", "Any_Run"),
        (RunRow, "start_time", "yesterday"),
        (Series, "series_id", "../x"),
        (Series, "path", "/etc/passwd"),
        (Series, "path", "series/../../x"),
        (Series, "path", "series/.x"),
        (Individuals, "base_iri", "file:///etc/"),
    ],
)
def test_what_irtwin_would_not_write_is_told(table: type[Base], column: str, value: object) -> None:
    with pytest.raises(ValueError, match=column):
        check_row(of(table), row_of(table) | {column: value})


def of(table: type[Base]) -> Table:
    assert isinstance(table.__table__, Table)
    return table.__table__


@pytest.mark.parametrize(
    ("table", "column", "value"),
    [
        (RobotRow, "weight_kg", "x"),
        (RobotRow, "weight_kg", b"\xff"),
        (RobotRow, "weight_kg", "9e999"),
        (RunRow, "started", 1e-310),
    ],
)
def test_a_workspace_whose_rows_another_program_changed_is_not_opened(
    tmp_path: Path, table: type[Base], column: str, value: object
) -> None:
    write(tmp_path, *dict.fromkeys([RobotRow, table]))
    change(tmp_path, f"UPDATE {of(table).name} SET {column} = ?", value)
    with pytest.raises(InputError, match=r"a row of table [a-z]+ was changed by another program: .*restore a backup"):
        Workspace(tmp_path)


def test_a_row_that_refers_to_none_is_told(tmp_path: Path) -> None:
    write(tmp_path, RobotRow, JointRow)
    change(tmp_path, "DELETE FROM robot")
    with pytest.raises(InputError, match=r"a row of table joint .*: it refers to no row of robot; restore a backup"):
        Workspace(tmp_path)


@pytest.mark.parametrize(
    "words",
    [
        "ALTER TABLE run_price RENAME TO other; CREATE VIEW run_price AS SELECT * FROM other",
        "CREATE TRIGGER mine AFTER UPDATE ON robot BEGIN DELETE FROM run; END",
        "CREATE TRIGGER irtwin_mine AFTER UPDATE ON robot BEGIN DELETE FROM run; END",
        "ALTER TABLE alembic_version RENAME TO other; CREATE VIEW alembic_version AS WITH RECURSIVE c(a) AS "
        "(SELECT 1 UNION ALL SELECT a + 1 FROM c) SELECT other.* FROM other, c",
    ],
)
def test_a_workspace_with_anothers_queries_in_its_tables_is_not_opened(tmp_path: Path, words: str) -> None:
    write(tmp_path)
    change(tmp_path, words)
    foreign = r"holds the (view|trigger) '(run_price|alembic_version|(irtwin_)?mine)', which irtwin did not make"
    with pytest.raises(InputError, match=foreign):
        Workspace(tmp_path)
