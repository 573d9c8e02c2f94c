"""Answers in Python's terms."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any, overload

from pyoxigraph import BlankNode, Literal, NamedNode, Triple

from irtwin.knowledge.vocabulary import XSD

Row = dict[str, Any]  # a variable's Python value, None where it is unbound

_INTEGERS = {XSD + name for name in ("integer", "int", "long", "short", "byte", "nonNegativeInteger", "unsignedInt")}
_FLOATS = {XSD + name for name in ("double", "float", "decimal")}


@dataclass(frozen=True)
class Table(Sequence[Row]):
    """The rows that answer a query, with its variables in the order of the query.

    `faults` says why functions of the query had no answer, each reason once.
    """

    columns: tuple[str, ...]
    rows: tuple[Row, ...]
    faults: Collection[str] = ()

    @overload
    def __getitem__(self, index: int) -> Row: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Row, ...]: ...

    def __getitem__(self, index: int | slice) -> Row | tuple[Row, ...]:
        """Return a row, or some."""
        return self.rows[index]

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.rows)


def to_python(term: NamedNode | BlankNode | Literal | Triple | None) -> Any:
    """Turn an RDF term into a Python value: an IRI into its text, a literal into number, time, truth or text."""
    if not isinstance(term, Literal):
        return None if term is None else term.value if isinstance(term, NamedNode) else str(term)
    kind = term.datatype.value
    try:
        if kind in _FLOATS:
            return float(term.value)
        if kind in _INTEGERS:
            return int(term.value)
        if kind == XSD + "boolean":
            return term.value in ("true", "1")
        if kind == XSD + "dateTime":
            return datetime.fromisoformat(term.value)
        if kind == XSD + "date":
            return date.fromisoformat(term.value)
    except ValueError:  # an ill-typed literal is shown as it is written
        return term.value
    return term.value
