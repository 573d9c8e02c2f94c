"""Spoils a data set's files, each way by its name: bytes, TOML, cells of a log, units, the order of time."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

VALUES = (
    *("9" * 5000, "1e999", "nan", "-inf", "[" * 3000, '"\\u0000"', "0001-01-01", "9999-12-31T23:59:59Z", '"x/\\u0000"'),
)
VALUES += (*("-1", "true", "{}", '""', "9" * 400, '"../../../etc/passwd"', "0x" + "f" * 300, "'''", "1e308", "5e-324"),)
KEYS = ("payload_mass", "file", "role", "name", "urdf", "power_at", "started", "payload_com", "repeat_of", "weight")
CELLS = ("nan", "inf", "", "x", "1e400", "9" * 5000, "-1e12", "\ufeff", "\x00", '"', "1,5", "1e9", "٣")


def _file(folder: Path, rng: np.random.Generator) -> Path:
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    return files[rng.integers(len(files))]


def _flip(folder: Path, rng: np.random.Generator) -> None:
    file = _file(folder, rng)
    data = bytearray(file.read_bytes() or b"x")
    for place in rng.integers(len(data), size=rng.integers(1, 9)):
        data[place] = rng.integers(256)
    file.write_bytes(data)


def _cut(folder: Path, rng: np.random.Generator) -> None:
    file = _file(folder, rng)
    data = file.read_bytes()
    file.write_bytes(data[: rng.integers(len(data) + 1)])


def _twice(folder: Path, rng: np.random.Generator) -> None:
    file = _file(folder, rng)
    file.write_bytes(file.read_bytes() * 2)


def _line_ends(folder: Path, rng: np.random.Generator) -> None:
    file = _file(folder, rng)
    mark = rng.choice([b"\xef\xbb\xbf", b"\xff\xfe", b""])
    file.write_bytes(mark + file.read_bytes().replace(b"\n", rng.choice([b"\r\n", b"\r", b"\n\n", b"\n\r\n"])))


def _toml(folder: Path, rng: np.random.Generator) -> None:
    file = folder / "dataset.toml"
    text, key, value = file.read_text(encoding="utf-8"), rng.choice(KEYS), rng.choice(VALUES)
    changed, count = re.subn(rf"^{key} = .*$", lambda _: f"{key} = {value}", text, count=1, flags=re.M)
    file.write_text(changed if count else text.replace("[[run]]", f"[[run]]\n{key} = {value}", 1), encoding="utf-8")


def _urdf(folder: Path, rng: np.random.Generator) -> None:
    file = folder / "robot.urdf"
    text = file.read_text(encoding="utf-8")
    values = list(re.finditer(r'"[^"]*"', text)) or [re.match("", text)]
    at = values[rng.integers(len(values))]
    value = rng.choice(["nan", "1e999", "", "-1", "1 2", "base", "\u0000", "9" * 5000, "1e308", "&x;", "link_1"])
    file.write_text(f'{text[: at.start()]}"{value}"{text[at.end() :]}', encoding="utf-8")


def _cell(folder: Path, rng: np.random.Generator) -> None:
    logs = sorted((folder / "runs").glob("*.csv"))
    if not logs:
        return _column(folder, rng)
    lines = logs[0].read_text(encoding="utf-8").splitlines()
    row = rng.integers(len(lines))
    cells = lines[row].split(",")
    cells[rng.integers(len(cells))] = rng.choice(CELLS)
    lines[row] = ",".join(cells)
    logs[0].write_text("\n".join(lines), encoding="utf-8")


def _column(folder: Path, rng: np.random.Generator) -> None:
    """Change a column: its order, unit, type or name."""

    def change(values: pa.ChunkedArray) -> pa.ChunkedArray:
        numbers = np.array(values.cast(pa.float64()))
        ways = (
            lambda: pa.array(numbers[::-1]),
            lambda: pa.array(np.rad2deg(numbers)),
            lambda: pa.array(np.where(rng.random(len(numbers)) < 0.05, rng.choice([np.nan, 1e300, 0.0]), numbers)),
            lambda: values.cast(pa.string()),
            lambda: pa.array([[number] for number in numbers]),
            lambda: values.cast(pa.string()).dictionary_encode(),
            lambda: pa.array([int(abs(number) * 1000) % 30000 for number in numbers], pa.date32()),
            lambda: pa.array([str(round(float(number), 3)) for number in numbers]).cast(pa.decimal128(30, 3)),
            lambda: pa.array([number > 0 for number in numbers]),
        )
        return ways[rng.integers(len(ways))]()

    file, table = _table(folder, rng)
    place = int(rng.integers(table.num_columns))
    table = table.set_column(place, table.column_names[place], change(table.column(place)))
    _keep(file, table)


def _columns(folder: Path, rng: np.random.Generator) -> None:
    """Change the columns: one gone, one twice, one renamed."""
    file, table = _table(folder, rng)
    place = int(rng.integers(table.num_columns))
    how = rng.integers(3)
    if how == 0:
        table = table.remove_column(place)
    elif how == 1:
        table = table.append_column(table.column_names[place], table.column(place))
    else:
        names = list(table.column_names)
        names[place] = str(rng.choice(["q_ghost", "", " time", "tau_", "POWER"]))
        table = table.rename_columns(names)
    _keep(file, table)


def _table(folder: Path, rng: np.random.Generator) -> tuple[Path, pa.Table]:
    logs = sorted((folder / "runs").iterdir())
    file = logs[rng.integers(len(logs))]
    return file, (pa.csv.read_csv if file.suffix == ".csv" else pa.parquet.read_table)(file)


def _keep(file: Path, table: pa.Table) -> None:
    if file.suffix == ".csv" and not any(pa.types.is_list(kind) for kind in table.schema.types):
        pa.csv.write_csv(table, file)
    else:
        pa.parquet.write_table(table, file)


WAYS: dict[str, Callable[[Path, np.random.Generator], None]] = {
    "flip bytes": _flip,
    "cut": _cut,
    "twice": _twice,
    "line ends": _line_ends,
    "toml": _toml,
    "urdf": _urdf,
    "cell": _cell,
    "column": _column,
    "columns": _columns,
}
