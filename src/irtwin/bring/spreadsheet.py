"""Logs in a workbook of Excel, by openpyxl."""

from __future__ import annotations

import zipfile
from itertools import islice
from pathlib import Path
from typing import Any

import pyarrow as pa

from irtwin.bring.head import LOOKED_AT, head_of
from irtwin.bring.recording import Recording, as_columns
from irtwin.bring.workbook_parts import check_parts
from irtwin.errors import InputError, first_line
from irtwin.input_file import Unpacking, check_file
from irtwin.signals.samples import FEWEST
from irtwin.signals.sources.source import MOST_COLUMNS

_MOST_ROWS = 1 << 20  # Excel's own limit
_BYTES = 8  # of a cell, blank ones between others included, and of a row
_REMEDY = "save the log as CSV, without blank rows and columns"


def read_sheet(path: Path) -> Recording:
    """Read the one sheet of a workbook that holds a log. Raises InputError where none does, or several do."""
    try:
        import openpyxl
    except ImportError as error:
        raise InputError(
            'Excel files need the package openpyxl; install it with: pip install "irtwin[excel]"'
        ) from error
    check_file(path)
    try:
        check_parts(path)
        book = openpyxl.load_workbook(path, read_only=True, data_only=True, keep_links=False)
        try:
            sheets = _sheets(path, book)
        finally:
            book.close()
    except (zipfile.BadZipFile, KeyError, ValueError, TypeError, EOFError, SyntaxError) as error:
        raise InputError(f"{path}: not a readable Excel file ({first_line(error)}); save it again") from error
    logs = {title: rows for title, rows in sheets.items() if len(rows) >= FEWEST}
    if len(logs) != 1:
        there = f"{', '.join(logs)} do" if logs else "none does"
        raise InputError(
            f"{path}: one sheet should hold the log, {there}; keep one, with a row of names and its samples"
        )
    ((title, rows),) = logs.items()
    return _recording(path, title, rows)


def _sheets(path: Path, book: Any) -> dict[str, list[tuple[Any, ...]]]:
    """Return the rows of each sheet. Raises InputError where they are too many."""
    parts = [sheet._worksheet_path for sheet in book.worksheets]
    if len(set(parts)) < len(parts):
        raise InputError(f"{path}: two sheets are one and the same part of the file; save it again")
    unpacking = Unpacking(path, path.stat().st_size)
    return {sheet.title: _rows(path, sheet, unpacking) for sheet in book.worksheets}


def _rows(path: Path, sheet: Any, unpacking: Unpacking) -> list[tuple[Any, ...]]:
    """Return a sheet's rows, without blank ones at its end; rows are of one length.

    They are counted as they come, for a row may say that it stands far below, and a cell far to the right.
    """
    sheet.reset_dimensions()  # what a file says of its size may be wrong
    rows: list[tuple[Any, ...]] = []
    blank = width = 0
    for number, row in enumerate(sheet.iter_rows(values_only=True), start=1):
        place = f"sheet {sheet.title[:40]}, row {number}"
        if number > _MOST_ROWS:
            raise InputError(f"{path}, {place}: a sheet has at most {_MOST_ROWS:,} rows; {_REMEDY}")
        if len(row) > MOST_COLUMNS:
            raise InputError(f"{path}, {place}: {len(row)} columns; a run has at most {MOST_COLUMNS}: {_REMEDY}")
        held = len(rows) * width
        if all(cell is None for cell in row):
            blank += 1
        else:
            rows += [()] * blank
            rows.append(row)
            blank, width = 0, max(width, len(row))
        unpacking.take(_BYTES * (1 + len(rows) * width - held), place, _REMEDY)
    return [(*row, *[None] * (width - len(row))) for row in rows]


def _recording(path: Path, title: str, rows: list[tuple[Any, ...]]) -> Recording:
    shown = [["" if cell is None else str(cell) for cell in row] for row in islice(rows, LOOKED_AT)]
    head = head_of(shown)
    if head is None:
        raise InputError(f"{path}, sheet {title}: row {len(shown)} holds no sample; keep the log alone in the sheet")
    names, units = head.names_in(shown), head.units_in(shown)
    cells = list(zip(*rows[head.first :], strict=True))
    table = pa.table([_cells(column) for column in cells], names=[str(number) for number in range(len(names))])
    columns, texts = as_columns(path, table.rename_columns(names), ("row", head.first + 1))
    stated = {name: unit for name, unit in zip(names, units, strict=True) if unit}
    return Recording(path, f"Excel, sheet {title}", columns, texts, stated, first=head.first + 1)


def _cells(column: tuple[Any, ...]) -> pa.Array:
    """Return a column as numbers or times where all its cells are, else as text: each once, for many may share it."""
    if not any(isinstance(cell, str) for cell in column):
        try:
            return pa.array(column)
        except (pa.ArrowException, OverflowError):  # of two kinds, or an integer of hundreds of digits
            pass
    places: dict[str, int] = {}
    indices = [None if cell is None else places.setdefault(str(cell), len(places)) for cell in column]
    return pa.DictionaryArray.from_arrays(pa.array(indices, pa.int32()), pa.array(places, pa.large_string()))
