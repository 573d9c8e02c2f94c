"""Sums over whatever a graph says of many individuals, in columns: a property's subjects and objects side by side.

Oxigraph looks every triple of a sum up by itself. Here a property is read once, in the order in which it is stored,
and DuckDB joins and groups it; the groups stay as long as the graph does.
"""

from __future__ import annotations

import threading
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

from pyoxigraph import BlankNode, DefaultGraph, Literal, NamedNode, Store, Triple

from irtwin.knowledge.store.table import to_python

if TYPE_CHECKING:
    import duckdb  # a tenth of a second to import, for those who sum by columns
    import numpy as np

Term = NamedNode | BlankNode | Literal | Triple
Groups = dict[tuple[Term, ...], "Totals"]


@dataclass(frozen=True)
class Path:
    """Properties, one after the other: from an entry of a ledger to its run, to its robot.

    `beginning` is how many letters count of the text at the end: seven of a time are its month.
    """

    properties: tuple[NamedNode, ...]
    beginning: int | None = None

    def end(self, term: Term) -> Term:
        """Return what stands at the end, where the properties lead to a term."""
        if self.beginning is None:
            return term
        return Literal(term.value[: self.beginning] if isinstance(term, Literal | NamedNode) else str(term))


@dataclass(frozen=True)
class Totals:
    """Of a group's numbers."""

    count: int
    sum: float
    min: float
    max: float

    @property
    def mean(self) -> float:
        """The arithmetic mean."""
        return self.sum / self.count

    def __add__(self, other: Totals) -> Totals:
        """Return the totals of two groups together."""
        return Totals(
            self.count + other.count, self.sum + other.sum, min(self.min, other.min), max(self.max, other.max)
        )


class Columns:
    """The columns of a store that is not written to; each is read when it is first asked for."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._codes: dict[Term, int] = {}
        self._tables: dict[NamedNode, str] = {}
        self._groups: dict[tuple[Path, ...], Groups] = {}
        self._one_at_a_time = threading.RLock()

    def groups(self, of: Path, by: tuple[Path, ...]) -> Groups:
        """Return the totals of the numbers that a path leads to, for each combination of what other paths lead to.

        All paths begin at one individual. A number counts once for each way that leads to it and to the combination, as
        in SPARQL; what is no number counts for nothing.
        """
        with self._one_at_a_time:
            known = self._groups.get((of, *by))
            if known is None:
                known = self._groups[(of, *by)] = self._grouped(of, by)
            return known

    def _grouped(self, of: Path, by: tuple[Path, ...]) -> Groups:
        joins: list[str] = []
        ends = []
        for number, path in enumerate((of, *by)):
            for step, table in enumerate(map(self._table, path.properties)):
                name, start = f"t{number}_{step}", f"t{number}_{step - 1}.o" if step else "t0_0.s"
                joins.append(f"JOIN {table} {name} ON {name}.s = {start}" if joins else f"FROM {table} {name}")
            ends.append(f"t{number}_{len(path.properties) - 1}")
        keys = [f"{end}.o AS k{number}" for number, end in enumerate(ends[1:])]
        values = [f"{name}({ends[0]}.v)" for name in ("count", "fsum", "min", "max")]
        grouping = f"GROUP BY {', '.join(f'k{number}' for number in range(len(by)))}" if by else ""
        text = f"SELECT {', '.join(keys + values)} {' '.join(joins)} WHERE {ends[0]}.v IS NOT NULL {grouping}"
        terms = list(self._codes)
        found: Groups = {}
        for row in self._database.execute(text).fetchall():
            codes, totals = row[: len(by)], Totals(*row[len(by) :])
            key = tuple(path.end(terms[code]) for path, code in zip(by, codes, strict=True))
            if totals.count:
                found[key] = found[key] + totals if key in found else totals
        return found

    def _table(self, property: NamedNode) -> str:
        """Return the name of the table that holds a property; it is read if it has not been."""
        if property not in self._tables:
            quads = self._store.quads_for_pattern(None, property, None, DefaultGraph())
            codes, pairs, numbers = self._codes, [], []
            for quad in quads:
                pairs.append([codes.setdefault(term, len(codes)) for term in (quad.subject, quad.object)])
                numbers.append(_number(quad.object))
            import numpy as np

            self._tables[property] = self._stored(np.array(pairs, dtype=np.int64).reshape(-1, 2), numbers)
        return self._tables[property]

    def _stored(self, pairs: np.ndarray, numbers: list[float | None]) -> str:
        import pyarrow as pa

        name = f"property_{len(self._tables)}"
        values = pa.array(numbers, pa.float64())
        read = pa.table({"s": pairs[:, 0], "o": pairs[:, 1], "v": values})
        self._database.register("read", read)
        self._database.execute(f"CREATE TEMP TABLE {name} AS SELECT * FROM read")
        self._database.unregister("read")
        return name

    @cached_property
    def _database(self) -> duckdb.DuckDBPyConnection:
        return _in_memory().cursor()  # its temporary tables are its own, and go with it


@lru_cache(maxsize=1)
def _in_memory() -> duckdb.DuckDBPyConnection:
    import duckdb

    return duckdb.connect(config={"autoload_known_extensions": False, "autoinstall_known_extensions": False})


def _number(term: Any) -> float | None:
    value = to_python(term)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else None
