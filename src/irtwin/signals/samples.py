"""The samples of one run: read from CSV or Parquet, and checked."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet

from irtwin.errors import InputError
from irtwin.input_file import check_file, read_input
from irtwin.robot.description import Joint, Robot

# the largest magnitude that any robot reaches, by the column's prefix
REACH = {
    "time": 1e11,
    "q": 1e4,
    "dq": 1e4,
    "ddq": 1e6,
    "tau": 1e6,
    "i": 1e5,
    "temp": 1e3,
    "power": 1e7,
    "voltage": 1e5,
    "current": 1e5,
}
_WHOLE_ROBOT = ("time", "power", "voltage", "current")
FEWEST = 20  # samples; fewer cannot be filtered
_MOST_COLUMNS = 10_000
_MOST_VALUES = 100_000_000  # of the columns that are read: 0.8 GB
_LARGEST_CSV = 1_000_000_000  # bytes; held in memory while it is read


@dataclass(frozen=True)
class Signals:
    """One run's samples as read, N rows of a robot of n joints; None where nothing was logged.

    time: (N,) s; q, dq, ddq: (N, n) rad, rad/s, rad/s^2 (m for prismatic joints); torque: (N, n) N m on the
    joint side; current: (N, n) A; temperature: (N, n) degC; power: (N,) W.
    """

    time: np.ndarray
    q: np.ndarray
    dq: np.ndarray | None = None
    ddq: np.ndarray | None = None
    torque: np.ndarray | None = None
    current: np.ndarray | None = None
    temperature: np.ndarray | None = None
    power: np.ndarray | None = None

    def rows(self, chosen: slice | np.ndarray) -> Signals:
        """Return some of the samples."""
        return replace(self, **{name: values[chosen] for name, values in vars(self).items() if values is not None})


def read_signals(path: Path, robot: Robot, *, repair: bool = False, measured: bool = True) -> tuple[Signals, list[str]]:
    """Read a run's file; return its signals and, with `repair`, a line for each kind of sample that was dropped.

    `measured`: whether torque or power has to be there, or the motion is enough. Raises InputError, naming file, line
    or row and column, on anything `LOG_FORMAT.md` calls bad input.
    """
    read = {".csv": _read_csv, ".parquet": _read_parquet}.get(path.suffix)
    if read is None:
        raise InputError(f"{path}: a run is a .csv or a .parquet file; convert it to one of these")
    table, first_line, repairs = read(path, robot, repair)
    columns = {name.strip(): _floats(table.column(name)) for name in table.column_names}
    where = _Where(path, first_line)
    keep, dropped = _bad_samples(columns, where, repair)
    if not keep.all():
        columns = {name: values[keep] for name, values in columns.items()}
    if len(columns["time"]) < FEWEST:
        raise InputError(f"{path}: has {len(columns['time'])} samples; a run needs at least {FEWEST}")
    for joint in robot.joints:
        _check_unit(columns["time"], columns[f"q_{joint.name}"], joint, path)
    signals = _signals(columns, robot, path)
    if measured and signals.torque is None and signals.power is None:
        raise InputError(f"{path}: has neither torque nor power; {_remedy(signals)}")
    return signals, repairs + dropped


@dataclass(frozen=True)
class _Where:
    """Names a sample the way its file counts: lines of text from 1, rows of Parquet from 0."""

    path: Path
    first_line: int | None

    def __call__(self, row: int, column: str) -> str:
        place = f"row {row}" if self.first_line is None else f"line {row + self.first_line}"
        return f"{self.path}, {place}, column {column}"


def _read_parquet(path: Path, robot: Robot, repair: bool) -> tuple[pa.Table, None, list[str]]:
    """Read the known columns of a file, once its own account of itself promises numbers that fit into the memory."""
    check_file(path)
    try:
        with pa.parquet.ParquetFile(path) as file:
            schema, groups = file.schema_arrow, range(file.num_row_groups)
            known = _known(schema.names, robot, path)
            rows = max(file.metadata.num_rows, sum(file.metadata.row_group(group).num_rows for group in groups))
            _check_size(rows, len(known), path)
            for name in known:
                if not _is_numeric(schema.field(name).type):
                    kind = str(schema.field(name).type)[:60]
                    raise InputError(f"{path}: column {name} is of type {kind}; export it as numbers, in SI units")
            return file.read(columns=known), None, []
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({_first_line(error)}); export the run again") from error
    except (pa.ArrowException, UnicodeDecodeError) as error:
        raise InputError(f"{path}: not a readable Parquet file ({_first_line(error)}); export the run again") from error


def _is_numeric(kind: pa.DataType) -> bool:
    return bool(pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind))


def _check_size(rows: int, columns: int, path: Path) -> None:
    if rows == 0:
        raise InputError(f"{path}: has no sample; an empty run cannot be used")
    if rows * columns > _MOST_VALUES:
        raise InputError(
            f"{path}: {rows} samples of {columns} columns; a run may have {_MOST_VALUES:,} values: cut it into several"
        )


def _read_csv(path: Path, robot: Robot, repair: bool) -> tuple[pa.Table, int, list[str]]:
    text = read_input(path, _LARGEST_CSV).rstrip()
    if not text:
        raise InputError(f"{path}: is empty; a run has one line of column names and one line per sample")
    if b"\n" not in text:
        raise InputError(f"{path}: has no sample below its first line; an empty run cannot be used")
    _check_characters(text, path)
    columns = text.count(b",", 0, text.index(b"\n")) + 1
    if columns > _MOST_COLUMNS:
        raise InputError(f"{path}, line 1: {columns} columns; a run has at most {_MOST_COLUMNS}")
    wrong: list[tuple[int, str]] = []

    def note(row: pa.csv.InvalidRow) -> str:
        wrong.append((row.number, f"{row.actual_columns} values instead of {row.expected_columns}"))
        return "skip"

    try:
        table = pa.csv.read_csv(
            io.BytesIO(text),
            read_options=pa.csv.ReadOptions(use_threads=False),
            parse_options=pa.csv.ParseOptions(invalid_row_handler=note, ignore_empty_lines=False),
            convert_options=pa.csv.ConvertOptions(strings_can_be_null=True),
        )
        known = _known(table.column_names, robot, path)
    except (pa.ArrowException, UnicodeDecodeError) as error:
        too_long = "straddling" in str(error)  # Arrow's word for a line longer than the block it reads at once
        reason = "a line is longer than 1 MB" if too_long else _first_line(error)
        raise InputError(f"{path}: not readable as CSV ({reason}); separate columns by commas") from error
    if wrong and not repair:
        line, what = wrong[0]
        last = ", the last one: the file was cut off" if line == text.count(b"\n") + 1 else ""
        raise InputError(f"{path}, line {line}{last}: {what}; correct it, or use --repair to drop such samples")
    lines = ", ".join(str(line) for line, _ in wrong[:10]) + (" ..." if len(wrong) > 10 else "")
    _check_size(table.num_rows, len(known), path)
    said = f"{path}: {len(wrong)} samples dropped, wrong number of values: line {lines}"
    return table.select(known), 2, [said] if wrong else []


def _check_characters(text: bytes, path: Path) -> None:
    """Raise where the text is not UTF-8: Arrow stumbles over such a line of the wrong length, and says so to nobody."""
    if text.isascii():
        return
    for number, line in enumerate(io.BytesIO(text), start=1):
        try:
            line.decode()
        except UnicodeDecodeError as error:
            raise InputError(
                f"{path}, line {number}: not UTF-8 text (byte {error.start + 1}); save the run as UTF-8"
            ) from error


def _known(columns: Sequence[str], robot: Robot, path: Path) -> list[str]:
    """Return those columns that the log format knows; raise on missing, repeated, foreign ones."""
    names = [name.strip() for name in columns]
    if len(names) > _MOST_COLUMNS:
        raise InputError(f"{path}: {len(names)} columns; a run has at most {_MOST_COLUMNS}")
    repeated = sorted(name for name, count in Counter(names).items() if count > 1)
    if repeated:
        raise InputError(f"{path}: column {repeated[0]} occurs twice; keep one")
    per_joint = {f"{kind}_{joint}" for kind in REACH if kind not in _WHOLE_ROBOT for joint in robot.joint_names}
    for name in names:
        kind, _, joint = name.partition("_")
        if kind in ("q", "dq", "ddq", "tau") and joint and name not in per_joint and joint not in robot.held:
            raise InputError(
                f'{path}: column {name}: the URDF has no moving joint "{joint}" (it has {", ".join(robot.joint_names)})'
            )
    for needed in ("time", *(f"q_{joint}" for joint in robot.joint_names)):
        if needed not in names:
            raise InputError(f"{path}: column {needed} is missing")
    known = per_joint.union(_WHOLE_ROBOT)
    return [column for column, name in zip(columns, names, strict=True) if name in known]


def _floats(column: pa.ChunkedArray) -> np.ndarray:
    if pa.types.is_string(column.type) or pa.types.is_large_string(column.type):
        return np.array([_float(value) for value in column.to_pylist()])
    if not _is_numeric(column.type):
        return np.full(len(column), np.nan)
    return np.array(column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False))


def _first_line(error: Exception) -> str:
    return str(error).strip().partition("\n")[0][:200]


def _float(text: str | None) -> float:
    try:
        return float(text) if text is not None else np.nan
    except ValueError:
        return np.nan


def _bad_samples(columns: dict[str, np.ndarray], where: _Where, repair: bool) -> tuple[np.ndarray, list[str]]:
    """Return which samples to keep and, with `repair`, what was dropped; raise at the first bad one without it."""
    keep = np.ones(len(columns["time"]), dtype=bool)
    dropped: list[str] = []

    def drop(bad: np.ndarray, column: str, what: str) -> None:
        if not bad.any():
            return
        rows = np.flatnonzero(bad)
        if not repair:
            raise InputError(f"{where(rows[0], column)}: {what}; correct it, or use --repair to drop such samples")
        shown = ", ".join(where(row, column).split(", ")[-2] for row in rows[:10]) + (" ..." if len(rows) > 10 else "")
        dropped.append(f"{where.path}: {len(rows)} samples dropped, column {column} {what}: {shown}")
        keep[rows] = False

    for name, values in columns.items():
        reach = REACH[name if name in _WHOLE_ROBOT else name.partition("_")[0]]
        drop(keep & ~np.isfinite(values), name, "is not a finite number")
        with np.errstate(invalid="ignore"):
            drop(keep & (np.abs(values) > reach), name, f"is beyond {reach:g}, which no robot reaches")
    kept = np.flatnonzero(keep)
    time = columns["time"][kept]
    latest = np.maximum.accumulate(time)
    falls = np.zeros(len(keep), dtype=bool)
    falls[kept[1:]] = time[1:] <= latest[:-1]
    drop(falls, "time", "does not rise")
    return keep, dropped


def _check_unit(time: np.ndarray, q: np.ndarray, joint: Joint, path: Path) -> None:
    """Raise where a position is plainly in degrees: its speed or its range is far beyond the joint's."""
    if joint.kind == "prismatic":
        return
    with np.errstate(over="ignore"):
        speed = np.quantile(np.abs(np.diff(q) / np.diff(time)), 0.99)
    bounds = joint.upper - joint.lower
    too_fast = np.isfinite(joint.velocity) and speed > 4 * joint.velocity
    too_far = np.isfinite(bounds) and bounds > 0 and np.ptp(q) > 1.5 * bounds
    unbounded = not np.isfinite(bounds) and np.ptp(q) > 100
    if too_far or unbounded or (too_fast and np.abs(q).max() > 2 * np.pi):
        raise InputError(
            f"{path}: column q_{joint.name} spans {np.ptp(q):.3g} at up to {speed:.3g} per second, "
            f"far beyond the joint's limits in rad: it looks like degrees; convert it to rad"
        )


def _signals(columns: dict[str, np.ndarray], robot: Robot, path: Path) -> Signals:
    def stack(kind: str) -> np.ndarray | None:
        names = [f"{kind}_{joint}" for joint in robot.joint_names]
        absent = [name for name in names if name not in columns]
        if len(absent) == len(names):
            return None
        if absent:
            raise InputError(f"{path}: column {absent[0]} is missing; log {kind}_ for every moving joint or for none")
        return np.column_stack([columns[name] for name in names])

    q = stack("q")
    assert q is not None
    torque, current, power = stack("tau"), stack("i"), columns.get("power")
    if torque is None and current is not None:
        constants = [joint.torque_constant for joint in robot.joints]
        if all(constant is not None for constant in constants):
            torque = current * np.array(constants, dtype=float)
    if power is None and {"voltage", "current"} <= columns.keys():
        power = columns["voltage"] * columns["current"]
    return Signals(columns["time"], q, stack("dq"), stack("ddq"), torque, current, stack("temp"), power)


def _remedy(signals: Signals) -> str:
    if signals.current is not None:
        return "give torque_constant for each joint in dataset.toml, or log tau_ or power"
    return "log tau_, i_ or power"
