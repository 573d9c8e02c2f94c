"""Tables that installed packages bring: what they must be, and that a workspace gets them."""

from __future__ import annotations

from pathlib import Path

import pytest
from sqlalchemy import Column, Float, ForeignKey, String, Table, inspect, text

from irtwin.errors import InputError
from irtwin.storage import database, package_tables
from irtwin.storage.database import Workspace
from irtwin.storage.schema import Base


def key(name: str, of: str, ondelete: str | None = "CASCADE", primary: bool = False) -> Column:
    return Column(name, String, ForeignKey(of, ondelete=ondelete), primary_key=primary)


def emission() -> Table:
    columns = [key("run_id", "run.run_id", primary=True), Column("grams", Float)]
    return Table("emission", Base.metadata, *columns, key("activity_id", "activity.activity_id"))


@pytest.mark.parametrize(
    ("columns", "said"),
    [
        ([key("run_id", "run.run_id", primary=True)], "has no column activity_id that refers to activity.activity_id"),
        ([key("activity_id", "run.run_id", primary=True)], "has no column activity_id"),
        ([key("activity_id", "activity.activity_id", None, True)], 'foreign key of activity_id ondelete="CASCADE"'),
    ],
)
def test_a_table_that_would_be_in_the_way_is_refused(columns: list[Column], said: str) -> None:
    table = Table("odd", Base.metadata, *columns)
    try:
        with pytest.raises(InputError, match=f"my_package.tables: .*{said}"):
            package_tables._check(table, "my_package.tables")
    finally:
        Base.metadata.remove(table)


def test_a_workspace_gets_tables_of_packages_later_and_anew(
    database_url: str | None, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Workspace(tmp_path, database_url) as place:  # before the package is installed
        assert not inspect(place.engine).has_table("emission")
    table = emission()
    monkeypatch.setattr(database, "package_tables", lambda: (table,))
    try:
        package_tables._check(table, "my_package.tables")
        with Workspace(tmp_path, database_url) as place, place.engine.begin() as connection:
            connection.execute(text("ALTER TABLE emission DROP COLUMN grams"))  # as another version of it had it
        with Workspace(tmp_path, database_url) as place:
            found = {column["name"] for column in inspect(place.engine).get_columns("emission")}
        assert found == {"run_id", "grams", "activity_id"}
    finally:
        Base.metadata.remove(table)
