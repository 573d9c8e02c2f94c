"""Given rows become quads without a look into the database, for individuals that change as one watches."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from pyoxigraph import Quad
from sqlalchemy import Engine

from irtwin.knowledge.mapping.plan import Statement
from irtwin.knowledge.mapping.processor import planned


class RowMapper:
    """Mapping documents, ready for rows of the tables that they name by rr:tableName.

    What a document reads by rr:sqlQuery or a join needs the database, and is left to `map_database`.
    """

    def __init__(self, engine: Engine, documents: Sequence[Path], base_iri: str | None = None) -> None:
        """Read the documents against a database. Raises InputError for a fault in one of them."""
        with planned(engine, documents, base_iri) as (_, statements):
            self._statements = [statement for statement in statements if statement.table]
        self._of_table: dict[str, list[Statement]] = {}  # as found

    def quads(self, table: str, rows: Iterable[Mapping[str, Any]]) -> Iterator[Quad]:
        """Yield what rows of a table become, values by column as the database's driver gives them.

        A column that a row lacks is NULL: it makes no quad. ValueError where no document names the table.
        """
        if table not in self._of_table:
            self._of_table[table] = [statement for statement in self._statements if _reads(statement, table)]
        statements = self._of_table[table]
        if not statements:
            raise ValueError(f"no mapping document reads table {table!r} by its name")
        for row in rows:
            for statement in statements:
                yield from statement.quads([row.get(column) for column in statement.columns])


def _reads(statement: Statement, table: str) -> bool:
    return statement.table[-1].find([table], folded=True) is not None
