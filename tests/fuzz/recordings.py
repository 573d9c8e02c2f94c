"""Logs of others for `irtwin import`: text of any form, workbooks, odd Parquet, names that no robot has."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from pathlib import Path

import numpy as np
import openpyxl
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from tests.fuzz.values import odd, some

_NAMES = (
    *("q_1", "J1 [deg]", "time [ms]", "t", "timestamp", "Zeit / s", "actual_q_0", "/joint_states/position[0]", "q.1"),
    *("a\0b", "\x1b[31m", "x" * 5000, "", " ", "名前", "\u202e", "=1+1", "{{7*7}}", "a\nb", 'a"b', "power;W", "\ufeff"),
)
_TIMES = ("2026-03-01 12:00:%09.6f", "2026-03-01T12:00:%06.3fZ", "12:00:%05.2f", "%f s")
_TIMES += ("1e%f", "%.3f", "1772366%06.2f")
_CODES = ("utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-32", "latin-1", "cp037", "shift_jis")


def _tables(runs: Path) -> list[tuple[Path, pa.Table]]:
    return [
        (file, (pa.csv.read_csv if file.suffix == ".csv" else pa.parquet.read_table)(file))
        for file in sorted(runs.iterdir())
        if file.suffix in (".csv", ".parquet")
    ]


def _cells(table: pa.Table) -> list[list[str]]:
    return [table.column_names, *([f"{value}" for value in row.values()] for row in table.to_pylist())]


def _put(file: Path, suffix: str, write: Callable[[io.BytesIO], object]) -> Path:
    """Put what is written in a log's place, which stays as it was where that cannot be written."""
    content = io.BytesIO()
    write(content)
    file.unlink()
    target = file.with_suffix(suffix)
    target.write_bytes(content.getvalue())
    return target


def _put_parquet(file: Path, table: pa.Table) -> None:
    _put(file, ".parquet", partial(pa.parquet.write_table, table))


def _text(runs: Path, rng: np.random.Generator) -> None:
    """Write the logs as text of some form."""
    for file, table in _tables(runs):
        cells, sign = _cells(table), some(rng, [",", ";", "\t", "|", " ", "::", "\x01"])
        if rng.integers(3) == 0:
            cells = [[cell.replace(".", ",") for cell in row] for row in cells]
        if rng.integers(3) == 0:
            cells.insert(1, [some(rng, ["s", "rad", "deg", "ms", "Nm", "%", "", "W", "kW"]) for _ in cells[0]])
        lines = [sign.join(row) for row in cells]
        if rng.integers(2):
            place = int(rng.integers(len(lines) + 1))
            lines.insert(
                place, some(rng, ["", "# note", sign * 3000, "x", '"', "nan" + sign, "\0", "1" * 9000, "; ; ;"])
            )
        if rng.integers(4) == 0:
            lines[:0] = [f"# made by {odd(rng)}"[:500].replace("\ud800", "")] * int(rng.integers(1, 90))
        end = some(rng, ["\n", "\r\n", "\r", "\n\n"])
        code = some(rng, _CODES) if rng.integers(3) == 0 else "utf-8"
        content = end.join(lines).encode(code, "replace")
        suffix = some(rng, [".csv", ".txt", ".log", ".tsv", "", ".CSV"])
        _put(file, suffix, lambda out, content=content: out.write(content))


def _names(runs: Path, rng: np.random.Generator) -> None:
    """Rename some columns, in Parquet."""
    for file, table in _tables(runs):
        names = [some(rng, _NAMES) if rng.integers(3) == 0 else name for name in table.column_names]
        _put_parquet(file, table.rename_columns(names))


def _times(runs: Path, rng: np.random.Generator) -> None:
    """Write the time as text, or in another unit."""
    for file, table in _tables(runs):
        form, scale = some(rng, _TIMES), some(rng, [1.0, 1e3, 1e6, 1e9, -1.0, 0.0])
        values: list[object] = list(np.asarray(table.column("time").cast(pa.float64())) * scale)
        if rng.integers(2):
            values = [form % value for value in values]
        if rng.integers(3) == 0:
            values[int(rng.integers(len(values)))] = None
        place = table.column_names.index("time")
        with suppress(pa.ArrowException):
            table = table.set_column(place, "time", pa.array(values))
        _put_parquet(file, table)


def _types(runs: Path, rng: np.random.Generator) -> None:
    """Add columns of types that are no numbers, or odd ones."""
    for file, table in _tables(runs):
        count = table.num_rows
        arrays = [
            pa.array([{"x": 1.0}] * count), pa.array([[1.0, 2.0]] * count), pa.array([b"\xff"] * count),
            pa.array([2**63] * count, pa.uint64()), pa.array([1] * count, pa.timestamp("s")), pa.nulls(count),
            pa.array([1] * count, pa.duration("ns")), pa.array([1] * count, pa.time32("s")), 
            pa.array([0.5] * count, pa.float16()),
            pa.array([-(2**62)] * count, pa.timestamp("s")), 
            pa.array([[("k", 1)]] * count, pa.map_(pa.string(), pa.int64())),
            pa.array(["x"] * count).dictionary_encode(), pa.array([1] * count, pa.timestamp("ns", "Mars/Base")),
        ]  # fmt: skip
        for _ in range(rng.integers(1, 4)):
            table = table.append_column(some(rng, _NAMES), some(rng, arrays))
        if rng.integers(3) == 0:
            table = table.set_column(0, "time", some(rng, arrays))
        _put_parquet(file, table)


def _many(runs: Path, rng: np.random.Generator) -> None:
    """Write very many columns, or few rows."""
    for file, table in _tables(runs):
        rows = int(some(rng, [0, 1, 2, 3, table.num_rows]))
        more = {f"x{number}": pa.array([0.0] * rows) for number in range(some(rng, [0, 300, 3000, 12_000]))}
        cut = table.slice(0, rows)
        whole = pa.table({**{name: cut.column(name) for name in cut.column_names}, **more})
        if rng.integers(2):
            _put_parquet(file, whole)
        else:
            _put(file, ".csv", partial(pa.csv.write_csv, whole))


def _workbook(runs: Path, rng: np.random.Generator) -> None:
    """Write the logs as workbooks, with cells of other kinds."""
    for file, table in _tables(runs):
        book = openpyxl.Workbook()
        sheet = book.active
        for row in table.slice(0, 60).to_pylist() if rng.integers(2) else table.to_pylist():
            if sheet.max_row == 1 and sheet["A1"].value is None:
                sheet.append(list(row))
            sheet.append(list(row.values()))
        for _ in range(rng.integers(4)):
            value = some(rng, ["=1/0", "=SUM(A:A)", "x", None, True, 1e300, "2026-03-01", "#DIV/0!", "x" * 9000, "1,5"])
            sheet.cell(int(rng.integers(1, 9)), int(rng.integers(1, 5))).value = value
        if rng.integers(3) == 0:
            sheet.cell(int(some(rng, [1, 5, 1_048_576])), int(some(rng, [1, 30, 16_384]))).value = 1
        if rng.integers(4) == 0:
            book.create_sheet("ЖЖ")["B3"] = 5
        if rng.integers(6) == 0:
            sheet.merge_cells("A1:C2")
        target = _put(file, some(rng, [".xlsx", ".xlsm", ".XLSX"]), book.save)
        if rng.integers(2):
            _inside(target, rng)


def _inside(file: Path, rng: np.random.Generator) -> None:
    """Change a part of a workbook: XML that is none, that is deep, that names files."""
    with zipfile.ZipFile(file) as source:
        parts = {name: source.read(name) for name in source.namelist()}
    name = some(rng, sorted(parts))
    how = rng.integers(7)
    if how == 0:
        del parts[name]
    elif how == 1:
        parts[name] = some(rng, [b"", b"x", b"\xff\xfe", b"<a>" * 50_000, b"<?xml version='1.0'?><x/>"])
    elif how == 2:
        entity = (
            b'<!DOCTYPE x [<!ENTITY a "aaaaaaaaaa"><!ENTITY b "&a;&a;&a;&a;"><!ENTITY c SYSTEM "file:///etc/passwd">]>'
        )
        head, sign, rest = parts[name].partition(b"?>")
        parts[name] = (head + sign + entity + rest) if sign else entity + parts[name]
    elif how == 3:
        sheet = next(name for name in sorted(parts) if "sheet1" in name)
        parts[sheet] = parts[sheet].replace(
            some(rng, [b't="n"', b"<v>", b'r="1"', b'r="A1"', b"</row>", b"<c "]),
            some(rng, [b't="s"', b"<v>x", b'r="99999999999"', b'r="ZZZZZ9"', b"</row><row>", b"", b'<c s="99" ']),
            int(rng.integers(1, 9)),
        )
    elif how == 4:
        parts[name] = parts[name][: rng.integers(len(parts[name]) + 1)]
    elif how == 5:
        parts["xl/worksheets/sheet1.xml"] += b" " * 100_000_000
    else:
        parts[f"../{name}"] = parts[name]
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED, compresslevel=1) as target:
        for name, content in parts.items():
            target.writestr(name, content)


def _no_log(runs: Path, rng: np.random.Generator) -> None:
    """Put what is no log there, under the name of one."""
    zipped = io.BytesIO()
    with zipfile.ZipFile(zipped, "w") as target:
        target.writestr("x", b"x")
    texts = [b"", b"x", b"\0" * 9000, b"PAR1" + b"\xff" * 40 + b"PAR1", zipped.getvalue()]
    texts += [
        b"SQLite format 3\0" + b"\0" * 84,
        b"#ROSBAG V2.0\n",
        b"\x89MCAP0\r\n" + b"\xff" * 90,
        b"[" * 99_999,
        b"a,b\n" * 20,
        b"time,q\n1,2\n",
    ]
    for file in sorted(runs.iterdir()):
        file.unlink()
        suffix = some(rng, [".csv", ".parquet", ".xlsx", ".mcap", ".bag", ".db3", "", ".txt", ".json"])
        file.with_suffix(suffix).write_bytes(some(rng, texts))


WAYS: dict[str, Callable[[Path, np.random.Generator], None]] = {
    "text": _text,
    "names": _names,
    "times": _times,
    "types": _types,
    "many": _many,
    "workbook": _workbook,
    "no log": _no_log,
}
