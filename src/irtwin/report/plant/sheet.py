"""A page's table as a file: CSV always, Excel where openpyxl is installed."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date, datetime
from importlib.util import find_spec

CSV, EXCEL = "text/csv", "application/vnd.openxmlformats-officedocument.spreadsheetml.sheet"
_FORMULA = ("=", "+", "-", "@", "\t", "\r")  # a spreadsheet runs text that begins so

Cell = str | int | float | bool | date | None


@dataclass(frozen=True)
class Sheet:
    """Columns, whose names say the unit, and rows of as many cells."""

    columns: tuple[str, ...]
    rows: Sequence[tuple[Cell, ...]]


def excel_is_there() -> bool:
    """Whether tables can be written for Excel."""
    return find_spec("openpyxl") is not None


def to_csv(sheet: Sheet) -> bytes:
    """Write a table as CSV (RFC 4180); text that a spreadsheet would run as a formula has an apostrophe before it."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(sheet.columns)
    writer.writerows([_for_csv(cell) for cell in row] for row in sheet.rows)
    return out.getvalue().encode()


def to_excel(sheet: Sheet) -> bytes:
    """Write a table as an Excel workbook, text as text; times are in UTC, which Excel has no word for."""
    from openpyxl import Workbook
    from openpyxl.cell import WriteOnlyCell
    from openpyxl.cell.cell import ILLEGAL_CHARACTERS_RE
    from openpyxl.styles import Font

    book = Workbook(write_only=True)
    page = book.create_sheet("irtwin")
    page.freeze_panes = "A2"
    bold = Font(bold=True)

    def cell(value: Cell, font: Font | None = None) -> WriteOnlyCell:
        if isinstance(value, str):
            made = WriteOnlyCell(page, ILLEGAL_CHARACTERS_RE.sub("", value))
            made.data_type = "s"  # or it would take "=..." for a formula
        else:
            made = WriteOnlyCell(page, value.replace(tzinfo=None) if isinstance(value, datetime) else _finite(value))
        if font is not None:
            made.font = font
        return made

    page.append([cell(name, bold) for name in sheet.columns])
    for row in sheet.rows:
        page.append([cell(value) for value in row])
    out = io.BytesIO()
    book.save(out)
    return out.getvalue()


def _for_csv(cell: Cell) -> Cell:
    if isinstance(cell, str):
        return f"'{cell}" if cell.startswith(_FORMULA) else cell
    return cell.isoformat() if isinstance(cell, date) else _finite(cell)


def _finite(cell: Cell) -> Cell:
    return None if isinstance(cell, float) and not math.isfinite(cell) else cell
