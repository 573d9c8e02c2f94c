"""Tables as files: numbers stay numbers, text is never run."""

from __future__ import annotations

import csv
import io
import math
from datetime import UTC, datetime

import pytest

from irtwin.report.plant.sheet import Sheet, to_csv, to_excel

MOMENT = datetime(2026, 3, 2, 8, tzinfo=UTC)
SHEET = Sheet(("name", "energy_kWh", "at"), [("=1+1", -1.5, MOMENT), ("@x", math.nan, None), ("plain", 3, None)])


def test_csv() -> None:
    rows = list(csv.reader(io.StringIO(to_csv(SHEET).decode())))
    assert rows[0] == ["name", "energy_kWh", "at"]
    assert rows[1:] == [["'=1+1", "-1.5", "2026-03-02T08:00:00+00:00"], ["'@x", "", ""], ["plain", "3", ""]]


@pytest.mark.parametrize("text", ["=a", "+a", "-a", "@a", "\ta", "\ra"])
def test_text_that_a_spreadsheet_would_run_is_quoted(text: str) -> None:
    ((_,), (cell,)) = csv.reader(io.StringIO(to_csv(Sheet(("x",), [(text,)])).decode(), newline=""))
    assert cell == f"'{text}"


def test_excel() -> None:
    openpyxl = pytest.importorskip("openpyxl")
    sheet = openpyxl.load_workbook(io.BytesIO(to_excel(SHEET))).active
    assert [[cell.value for cell in row] for row in sheet.iter_rows()] == [
        ["name", "energy_kWh", "at"], ["=1+1", -1.5, MOMENT.replace(tzinfo=None)], ["@x", None, None],
        ["plain", 3, None],
    ]  # fmt: skip
    assert sheet["A2"].data_type == "s"
    assert to_excel(Sheet(("x",), [("a\x00b",)]))
