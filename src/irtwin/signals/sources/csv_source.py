"""Runs as text: a line of column names, then a line for each sample."""

from __future__ import annotations

import io
from collections.abc import Sequence
from functools import cached_property
from typing import Any, ClassVar

import pyarrow as pa
import pyarrow.csv

from irtwin.errors import InputError, first_line
from irtwin.input_file import as_text, read_input
from irtwin.signals.sources.source import LONGEST_LINE, MOST_COLUMNS, Source

_LARGEST = 1_000_000_000  # bytes; held in memory while it is read
_OTHERS = {b";": "semicolons", b"\t": "tabs", b"|": "bars"}


class CsvSource(Source):
    """Values separated by commas, in UTF-8."""

    suffixes: ClassVar[tuple[str, ...]] = (".csv",)
    counted: ClassVar[str] = "line"
    first: ClassVar[int] = 2

    def columns(self) -> Sequence[str]:
        """Return the names in the first line."""
        return list(self._parsed[0].column_names)

    def read(self, columns: Sequence[str], *, repair: bool) -> tuple[pa.Table, list[str]]:
        """Return some of the columns; `repair` drops lines of more or fewer values than the first."""
        table, wrong, lines = self._parsed
        if wrong and not repair:
            expected, has, line, _ = wrong[0]
            last = ", the last one: the file was cut off" if line == lines else ""
            raise InputError(
                f"{self.path}, line {line}{last}: {has} values instead of {expected}; correct it, or use --repair to "
                "drop such samples"
            )
        self.check_size(table.num_rows, len(columns))
        shown = ", ".join(str(row.number) for row in wrong[:10]) + (" ..." if len(wrong) > 10 else "")
        note = f"{self.path}: {len(wrong)} samples dropped, wrong number of values: line {shown}"
        return table.select(columns), [note] if wrong else []

    @cached_property
    def _parsed(self) -> tuple[pa.Table, list[pa.csv.InvalidRow], int]:
        """The file's samples, its lines of more or fewer values than the first, and how many lines it has."""
        text = self._text()
        try:
            return *parsed(text), text.count(b"\n") + 1
        except (pa.ArrowException, UnicodeDecodeError) as error:
            raise InputError(
                f"{self.path}: not readable as CSV ({csv_fault(error)}); separate columns by commas"
            ) from error

    def _text(self) -> bytes:
        text = read_input(self.path, _LARGEST).rstrip()
        if not text:
            raise InputError(f"{self.path}: is empty; a run has one line of column names and one line per sample")
        if b"\n" not in text:
            raise InputError(f"{self.path}: has no sample below its first line; an empty run cannot be used")
        if not text.isascii():
            as_text(self.path, text)  # Arrow stumbles over such a line of the wrong length, and says so to nobody
        head = text[: text.index(b"\n")]
        if b"," not in head and (separator := next((sign for sign in (b";", b"\t", b"|") if sign in head), None)):
            raise InputError(
                f"{self.path}, line 1: columns are separated by {_OTHERS[separator]}; separate them by commas, or let "
                "`irtwin import` do that"
            )
        columns = head.count(b",") + 1
        if columns > MOST_COLUMNS:
            raise InputError(f"{self.path}, line 1: {columns} columns; a run has at most {MOST_COLUMNS}")
        return text


def parsed(
    text: bytes,
    names: Sequence[str] | None = None,
    delimiter: str = ",",
    ignore_empty_lines: bool = False,
    **conversion: Any,
) -> tuple[pa.Table, list[pa.csv.InvalidRow]]:
    """Return the samples of a text, and its lines of more or fewer values; `names` where no line has them.

    conversion: as `pyarrow.csv.ConvertOptions` takes it. Raises pa.ArrowException, UnicodeDecodeError.
    """
    wrong: list[pa.csv.InvalidRow] = []

    def note(row: pa.csv.InvalidRow) -> str:
        wrong.append(row)
        return "skip"

    table = pa.csv.read_csv(
        io.BytesIO(text),
        pa.csv.ReadOptions(use_threads=False, column_names=names),
        pa.csv.ParseOptions(delimiter=delimiter, invalid_row_handler=note, ignore_empty_lines=ignore_empty_lines),
        pa.csv.ConvertOptions(strings_can_be_null=True, **conversion),
    )
    return table, wrong


def csv_fault(error: Exception) -> str:
    """Return what is wrong with a text that Arrow does not read."""
    too_long = "straddling" in str(error)  # Arrow's word for a line longer than the block it reads at once
    return f"a line is longer than {LONGEST_LINE // 1_000_000} MB" if too_long else first_line(error)
