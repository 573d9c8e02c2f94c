"""A log as its file has it: columns by their names there, whatever they may mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet

from irtwin.bring.head import MISSING
from irtwin.errors import InputError
from irtwin.input_file import check_file
from irtwin.robot.description import Robot
from irtwin.signals.sources.catalogue import registered, source_of
from irtwin.signals.sources.source import MOST_COLUMNS, MOST_VALUES, first_line

BAGS = (".bag", ".mcap", ".db3")
SHEETS = (".xlsx", ".xlsm")


@dataclass(frozen=True)
class Recording:
    """A file's columns, (N,) each: numbers as float64, NaN where a cell is blank, or times as datetime64[ns].

    `texts`: columns that hold neither; `units`: what a line below the names, or the format, says of their units;
    `form`: what the file is, in words; `said`: what was done in reading; `topics`: whether it is a ROS bag.
    """

    path: Path
    form: str
    columns: Mapping[str, np.ndarray]
    texts: tuple[str, ...] = ()
    units: Mapping[str, str] = field(default_factory=dict)
    said: tuple[str, ...] = ()
    first: int = 1  # place of the first sample
    counted: str = "row"
    is_bag: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all columns."""
        return (*self.columns, *self.texts)

    def place(self, sample: int) -> str:
        """Return what a message calls a sample, counted from 0."""
        return f"{self.counted} {sample + self.first}"


def read_recording(path: Path, robot: Robot, topics: Mapping[str, str]) -> Recording:
    """Read a log in whatever form it is. Raises InputError where it cannot be read."""
    from irtwin.bring.delimited_text import read_text
    from irtwin.bring.spreadsheet import read_sheet

    suffix = path.suffix.lower()
    if path.is_dir() or suffix in BAGS:
        return _bag(path, robot, topics)
    if suffix in SHEETS:
        return read_sheet(path)
    if suffix in registered():
        return _of_package(path, robot, topics)
    return _parquet(path) if suffix == ".parquet" else read_text(path)


def as_columns(path: Path, table: pa.Table, places: tuple[str, int]) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Return a table's columns of numbers and times, and the names of the others.

    A column of which most cells are numbers must have no other text; `places`: what a row is called, and the first
    one's number. Raises InputError, naming file, place and column.
    """
    names = [name.strip() for name in table.column_names]
    if len(names) > MOST_COLUMNS or len(names) * table.num_rows > MOST_VALUES:
        raise InputError(
            f"{path}: {len(names)} columns of {table.num_rows} rows are too many; cut the log into several"
        )
    repeated = next((name for name in names if names.count(name) > 1), None) if len(set(names)) < len(names) else None
    if repeated is not None:
        raise InputError(f"{path}: column {repeated} occurs twice; keep one, or give each a name of its own")
    columns: dict[str, np.ndarray] = {}
    for name, column in zip(names, table.columns, strict=True):
        values = _values(column)
        if values is None:
            values = _parsed(path, name, column.to_pylist(), places)
        if values is not None:
            columns[name] = values
    return columns, tuple(name for name in names if name not in columns)


def _values(column: pa.ChunkedArray) -> np.ndarray | None:
    kind = column.type
    if pa.types.is_timestamp(kind):
        return np.asarray(column.cast(pa.timestamp("ns")).to_numpy()).astype("datetime64[ns]")
    if pa.types.is_boolean(kind):
        return None
    if pa.types.is_integer(kind) and column.null_count == 0:
        return np.asarray(column.to_numpy())  # whole: nanoseconds since 1970 are beyond a float
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind):
        return np.asarray(pc.fill_null(column.cast(pa.float64(), safe=False), np.nan).to_numpy())
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    return None


def _parsed(path: Path, name: str, cells: Sequence[object], places: tuple[str, int]) -> np.ndarray | None:
    """Return a column of text as times or numbers; None where most of it is neither."""
    texts = [None if cell is None or str(cell).strip().lower() in MISSING else str(cell).strip() for cell in cells]
    known = [text for text in texts if text is not None]
    if not known:
        return np.full(len(cells), np.nan)
    for parse, missing in ((_number, float("nan")), (_instant, np.datetime64("NaT"))):
        if sum(parse(text) is not None for text in known[:50]) * 2 <= len(known[:50]):
            continue
        values = [missing if text is None else parse(text) for text in texts]
        if (bad := next((row for row, value in enumerate(values) if value is None), None)) is not None:
            raise InputError(
                f"{path}, {places[0]} {bad + places[1]}, column {name}: {str(texts[bad])[:40]!r} is no "
                f"{'number' if parse is _number else 'time'}; correct it, or leave the cell blank"
            )
        return np.array(values)
    return None


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _instant(text: str) -> np.datetime64 | None:
    """Return a time of ISO 8601, to the nanosecond; UTC where it has no zone."""
    from datetime import UTC, datetime

    whole, sign, rest = text.replace(",", ".").partition(".")
    digits = rest[: next((place for place, sign in enumerate(rest) if not sign.isdigit()), len(rest))]
    try:
        moment = datetime.fromisoformat(whole + rest[len(digits) :])
    except ValueError:
        return None
    zoned = moment if moment.tzinfo is None else moment.astimezone(UTC).replace(tzinfo=None)
    return np.datetime64(zoned, "ns") + np.timedelta64(int((digits + "000000000")[:9]) if sign else 0, "ns")


def _parquet(path: Path) -> Recording:
    check_file(path)
    try:
        file = pyarrow.parquet.ParquetFile(path)
        if file.metadata.num_rows * len(file.schema_arrow) > MOST_VALUES:
            raise InputError(f"{path}: more than {MOST_VALUES:,} values; cut the log into several")
        table = file.read()
    except (OSError, pa.ArrowException) as error:
        raise InputError(f"{path}: not a readable Parquet file ({first_line(error)}); export the log again") from error
    columns, texts = as_columns(path, table, ("row", 1))
    return Recording(path, "Parquet", columns, texts)


def _of_package(path: Path, robot: Robot, topics: Mapping[str, str]) -> Recording:
    """Read a file by the source that an installed package brought for it."""
    source = source_of(path, robot, topics)
    table, said = source.read(source.columns(), repair=False)
    columns, texts = as_columns(path, table, (source.counted, source.first))
    form = f"{path.suffix.lower()}, by {type(source).__module__.partition('.')[0]}"
    return Recording(path, form, columns, texts, said=tuple(said), first=source.first, counted=source.counted)


def _bag(path: Path, robot: Robot, topics: Mapping[str, str]) -> Recording:
    source = source_of(path, robot, topics)
    table, said = source.read(source.columns(), repair=False)
    columns, texts = as_columns(path, table, ("joint state", 1))
    return Recording(path, "ROS bag", columns, texts, said=tuple(said), counted="joint state", is_bag=True)
