"""Logs in a workbook of Excel, by openpyxl."""

from __future__ import annotations

import zipfile
from itertools import islice
from pathlib import Path
from typing import Any

import pyarrow as pa

from irtwin.bring.head import LOOKED_AT, head_of
from irtwin.bring.recording import Recording, as_columns
from irtwin.errors import InputError
from irtwin.input_file import check_file
from irtwin.signals.samples import FEWEST
from irtwin.signals.sources.source import MOST_COLUMNS, first_line

_LARGEST = 1_000_000_000  # bytes, inflated


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
        with zipfile.ZipFile(path) as packed:
            if sum(part.file_size for part in packed.infolist()) > _LARGEST:
                raise InputError(f"{path}: is larger than 1 GB; save the log as CSV")
        book = openpyxl.load_workbook(path, read_only=True, data_only=True)
        try:
            sheets = {sheet.title: _rows(sheet) for sheet in book.worksheets}
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


def _rows(sheet: Any) -> list[tuple[Any, ...]]:
    """Return a sheet's rows, without blank ones at its end; rows are of one length."""
    sheet.reset_dimensions()  # what a file says of its size may be wrong
    rows = [row[:MOST_COLUMNS] for row in sheet.iter_rows(values_only=True)]
    while rows and all(cell is None for cell in rows[-1]):
        rows.pop()
    width = max((len(row) for row in rows), default=0)
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
    said = {name: unit for name, unit in zip(names, units, strict=True) if unit}
    return Recording(path, f"Excel, sheet {title}", columns, texts, said, first=head.first + 1)


def _cells(column: tuple[Any, ...]) -> pa.Array:
    """Return a column as numbers or times where all its cells are, else as text."""
    try:
        return pa.array(column)
    except pa.ArrowException:
        return pa.array([None if cell is None else str(cell) for cell in column])
