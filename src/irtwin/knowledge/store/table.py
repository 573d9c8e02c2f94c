"""Answers in Python's terms."""

from __future__ import annotations

import html
from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from dataclasses import dataclass
from datetime import date, datetime
from typing import Any, overload

from pyoxigraph import BlankNode, Literal, NamedNode, QueryBoolean, QuerySolutions, QueryTriples, Triple

from irtwin.errors import InputError
from irtwin.knowledge.vocabulary import XSD

MOST_ROWS = 1_000_000
Row = dict[str, Any]  # a variable's Python value, None where it is unbound

_INTEGERS = ("integer", "int", "long", "short", "byte", "nonNegativeInteger", "unsignedInt")
_VALUES: dict[str, Callable[[str], Any]] = {
    **{XSD + name: float for name in ("double", "float", "decimal")},
    **{XSD + name: int for name in _INTEGERS},
    XSD + "boolean": lambda text: text in ("true", "1"),
    XSD + "dateTime": datetime.fromisoformat,
    XSD + "date": date.fromisoformat,
}


@dataclass(frozen=True)
class AnswerTable(Sequence[Row]):
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
        return self.rows[index]

    def __len__(self) -> int:
        return len(self.rows)

    def _repr_html_(self) -> str:
        """Return it as a table, which notebooks show."""
        told = [[_shown(row[column]) for column in self.columns] for row in self.rows]
        lines = [_line("th", self.columns), *(_line("td", row) for row in told)]
        return f"<table>{''.join(lines)}</table>"


def _shown(value: Any) -> str:
    return "" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _line(tag: str, cells: Iterable[str]) -> str:
    return f"<tr>{''.join(f'<{tag}>{html.escape(cell)}</{tag}>' for cell in cells)}</tr>"


def table_of(answer: QuerySolutions | QueryBoolean | QueryTriples, faults: Collection[str] = ()) -> AnswerTable:
    """Return an answer as a table; `faults` may be told while its rows are found. InputError where it has too many."""
    if isinstance(answer, QueryBoolean):
        return AnswerTable(("answer",), ({"answer": bool(answer)},))
    if isinstance(answer, QuerySolutions):
        columns = tuple(variable.value for variable in answer.variables)
        return AnswerTable(columns, tuple(_row(columns, solution) for solution in _counted(answer)), faults)
    columns = ("subject", "predicate", "object")
    return AnswerTable(columns, tuple(_row(columns, triple) for triple in _counted(answer)))


def to_python(term: NamedNode | BlankNode | Literal | Triple | None) -> Any:
    """Turn an RDF term into a Python value: an IRI into its text, a literal into number, time, truth or text."""
    if not isinstance(term, Literal):
        return None if term is None else term.value if isinstance(term, NamedNode) else str(term)
    try:
        return _VALUES.get(term.datatype.value, str)(term.value)
    except ValueError:  # an ill-typed literal is shown as it is written
        return term.value


def _row(columns: Sequence[str], terms: Iterable[Any]) -> Row:
    return {name: to_python(term) for name, term in zip(columns, terms, strict=True)}


def _counted(answers: Iterable[Any]) -> Iterator[Any]:
    for count, answer in enumerate(answers):
        if count == MOST_ROWS:
            raise InputError(f"the query has more than {MOST_ROWS:,} answers: add a LIMIT or narrow the query")
        yield answer
