"""Logs as text: any delimiter, decimal points or commas, lines before the names, a line of units after them."""

from __future__ import annotations

import csv
import re
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.csv

from irtwin.bring.head import CLOCK, DATE, LOOKED_AT, Head, head_of, numbers_in
from irtwin.bring.recording import Recording, as_columns
from irtwin.errors import InputError
from irtwin.input_file import read_input
from irtwin.signals.sources.csv_source import csv_fault, parsed
from irtwin.signals.sources.parquet_file import is_text
from irtwin.signals.sources.source import LONGEST_LINE, MOST_COLUMNS

_LARGEST = 1_000_000_000  # bytes
_DELIMITERS = {"\t": "tabs", ";": "semicolons", ",": "commas", "|": "bars", " ": "blanks"}
_NULLS = ["", "nan", "NaN", "-nan", "NAN", "NA", "N/A", "#N/A", "null", "NULL", "None", "-"]
_COMMA = re.compile(r"[+-]?\d*,\d+([eE][+-]?\d+)?")
_BLANKS = re.compile(r"[ \t]+")


@dataclass(frozen=True)
class TextForm:
    """How a text is written: what stands between values, the decimal sign, and where its rows stand."""

    delimiter: str
    decimal: str
    head: Head
    rows: list[list[str]]

    def __str__(self) -> str:
        """In words."""
        return f"text, {_DELIMITERS[self.delimiter]}, decimal {'points' if self.decimal == '.' else 'commas'}"


def read_text(path: Path) -> Recording:
    """Read a text file. Raises InputError where no delimiter makes columns of it, or a line is of another length."""
    text = _decoded(path, read_input(path, _LARGEST)).replace("\r\n", "\n").rstrip()
    lines = text.split("\n", 2 * LOOKED_AT)[: 2 * LOOKED_AT]
    kept = [number for number, line in enumerate(lines) if line.strip()][:LOOKED_AT]
    _check_lines(path, lines)
    form = _form(path, [lines[number] for number in kept])
    before = kept[form.head.first]
    _check_names(path, form)
    names, units = form.head.names_in(form.rows), form.head.units_in(form.rows)
    table, cut = _table(path, text.split("\n", before)[-1], form, names, before)
    table = _with_moments(table)
    columns, texts = as_columns(path, table, ("line", before + 1))
    nameless = f"{path}: has no line of names; its columns are called column_1, column_2 and so on, or as --names says"
    return Recording(
        path,
        str(form),
        columns,
        texts,
        {name: unit for name, unit in zip(names, units, strict=False) if unit},
        tuple(line for line in (None if form.head.names is not None else nameless, cut) if line),
        first=before + 1,
        counted="line",
    )


def _check_lines(path: Path, lines: Sequence[str]) -> None:
    """Raise InputError where one of the first lines is longer, or has more values, than a log's."""
    for number, line in enumerate(lines, start=1):
        if len(line) > LONGEST_LINE:
            raise InputError(f"{path}, line {number}: is longer than {LONGEST_LINE // 1_000_000} MB; export it again")
        values = max(line.count(delimiter) for delimiter in _DELIMITERS if delimiter != " ") + 1
        if values > MOST_COLUMNS:
            raise InputError(
                f"{path}, line {number}: {values} columns; a run has at most {MOST_COLUMNS}: leave out what nobody "
                "needs"
            )


def _form(path: Path, lines: Sequence[str]) -> TextForm:
    """Return how the beginning of a text is written. Raises InputError where that cannot be told."""
    forms = []
    for delimiter in _DELIMITERS:
        rows = [_split(line, delimiter) for line in lines]
        head = head_of(rows)
        if head is not None:
            forms.append(TextForm(delimiter, _decimal(rows[head.first :], delimiter), head, rows))
    if not forms:
        raise InputError(
            f"{path}: no delimiter (comma, semicolon, tab, blank) makes even columns of numbers of it; export it as "
            "CSV, one line of names and one line a sample, in semicolons where decimals have commas"
        )
    return max(forms, key=_fit)


def _check_names(path: Path, form: TextForm) -> None:
    """Raise InputError where the line above the samples has many names, but not one for each value."""
    above = form.rows[form.head.first - 1] if form.head.first and form.head.names is None else []
    values = len(form.rows[form.head.first])
    if values > len(above) > values / 3:
        raise InputError(
            f"{path}: samples have {values} values, the line above them {len(above)} names; where decimals have "
            "commas, columns need another delimiter: export it with semicolons"
        )


def _fit(form: TextForm) -> tuple[bool, float, int]:
    """Return how well a form fits: a delimiter that is none cuts numbers in two, and names elsewhere than samples."""
    sample = form.rows[form.head.first]
    return form.head.names is not None, numbers_in(sample) / len(sample), len(sample)


def _decimal(samples: Sequence[Sequence[str]], delimiter: str) -> str:
    commas = delimiter != "," and any(_COMMA.fullmatch(cell.strip()) for row in samples for cell in row)
    return "," if commas else "."


def _split(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split(maxsplit=MOST_COLUMNS)
    try:
        return next(csv.reader([line], delimiter=delimiter), [])
    except csv.Error:  # a cell beyond 128 kB: this delimiter makes no columns of the line
        return [line]


def _decoded(path: Path, content: bytes) -> str:
    if content[:2] in (b"\xff\xfe", b"\xfe\xff"):
        return content.decode("utf-16", errors="replace")
    if b"\0" in content[:4096]:
        packed = "is packed; unpack it, and give what is in it" if content[:2] in (b"PK", b"\x1f\x8b") else "is no text"
        raise InputError(f"{path}: {packed}: a CSV, Parquet or Excel file or a ROS bag")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = content.decode("cp1252", errors="replace")  # what spreadsheet programs write under Windows
    if not text.strip():
        raise InputError(f"{path}: is empty; a log has one line of names and one line a sample")
    return text


def _with_moments(table: pa.Table) -> pa.Table:
    """Return a table in which a date and the time of day beside it are one column, as meters write them in two."""
    for place, pair in enumerate(pairwise(table.columns)):
        if not all(
            is_text(column.type) or pa.types.is_date(column.type) or pa.types.is_time(column.type) for column in pair
        ):
            continue
        days, hours = (column.cast(pa.string()) for column in pair)
        cells = zip(days.slice(0, LOOKED_AT).to_pylist(), hours.slice(0, LOOKED_AT).to_pylist(), strict=True)
        if all(day and hour and DATE.fullmatch(day) and CLOCK.fullmatch(hour) for day, hour in cells):
            moments = pc.binary_join_element_wise(days, hours, " ")
            name = " ".join(table.column_names[place : place + 2])
            return table.remove_column(place + 1).set_column(place, name, moments)
    return table


def _table(path: Path, body: str, form: TextForm, names: list[str], before: int) -> tuple[pa.Table, str | None]:
    """Return the samples, and what is to be said of a last line that was cut off."""
    if form.delimiter == " ":
        body = "\n".join(_BLANKS.sub(" ", line.strip()) for line in body.split("\n"))
    numbers, options = [str(k) for k in range(len(names))], {"decimal_point": form.decimal, "null_values": _NULLS}
    try:
        table, wrong = parsed(body.encode(), numbers, form.delimiter, len(names) > 1, **options)
    except pa.ArrowException as error:
        raise InputError(f"{path}: not readable as {form} ({csv_fault(error)}); export it again") from error
    if wrong:
        expected, has, line, _ = wrong[0]
        if len(wrong) == 1 and line == table.num_rows + 1 and has < expected:
            return table.rename_columns(names), f"{path}, line {line + before}: the last, is cut off; it is left out"
        raise InputError(
            f"{path}, line {line + before}: {has} values instead of {expected}; correct it, or remove such lines"
        )
    return table.rename_columns(names), None
