"""A database in memory has the tables of a workspace, and keeps nothing."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import inspect, select
from tests import rows

from irtwin.storage.database import Workspace
from irtwin.storage.in_memory import in_memory
from irtwin.storage.schema import Joint


def test_it_has_the_tables_of_a_workspace_and_the_rows_that_were_given(tmp_path: Path) -> None:
    with Workspace(tmp_path) as workspace, in_memory([*rows.joints(), rows.robot()]) as engine:
        kept = set(inspect(workspace.engine).get_table_names())
        assert set(inspect(engine).get_table_names()) == kept - {"alembic_version"}
        with engine.connect() as connection:
            assert list(connection.scalars(select(Joint.name))) == ["joint_a1", "joint_a2"]


def test_each_is_a_database_of_its_own() -> None:
    for _ in range(2):
        with in_memory([rows.robot()]) as engine, engine.connect() as connection:
            assert not list(connection.scalars(select(Joint.name)))
