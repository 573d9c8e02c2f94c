"""Tables of installed packages: modules that the entry points of the group `irtwin.tables` name.

Each holds what providers of the package made. So it carries their activity, which it goes with, and deleting what it
refers to deletes its rows, be the package installed then or not.
"""

from __future__ import annotations

from functools import cache
from importlib.metadata import entry_points

from sqlalchemy import Table
from sqlalchemy.exc import InvalidRequestError

from irtwin.errors import InputError
from irtwin.storage.schema import Activity, Base

GROUP = "irtwin.tables"


@cache
def package_tables() -> tuple[Table, ...]:
    """Return the tables that installed packages bring, among those of `Base`. Raises InputError where one cannot be."""
    for point in sorted(entry_points(group=GROUP), key=lambda point: point.value):
        try:
            point.load()
        except InvalidRequestError as error:
            raise InputError(f"{point.value}: its tables do not go with those that are there: {error}") from error
    tables = []
    for mapper in Base.registry.mappers:
        table, module = mapper.local_table, mapper.class_.__module__
        if isinstance(table, Table) and not module.startswith("irtwin."):
            _check(table, module)
            tables.append(table)
    return tuple(tables)


def _check(table: Table, module: str) -> None:
    keys = table.foreign_keys
    activity = Activity.__table__.columns["activity_id"]
    if not any(key.parent.name == "activity_id" and key.column is activity for key in keys):
        raise InputError(f"{module}: table {table.name} has no column activity_id that refers to activity.activity_id")
    held = [key for key in keys if (key.ondelete or "").upper() != "CASCADE"]
    if held:
        raise InputError(
            f'{module}: table {table.name}: give the foreign key of {held[0].parent.name} ondelete="CASCADE": else '
            "robots could not be removed once the package is gone"
        )
