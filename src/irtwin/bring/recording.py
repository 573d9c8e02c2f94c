"""A log as its file has it: columns by their names there, whatever they may mean."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from irtwin.bring.head import MISSING
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.sources.catalogue import registered, source_of
from irtwin.signals.sources.parquet_file import is_text, open_parquet, read_columns
from irtwin.signals.sources.source import check_names, check_values
from irtwin.toml_file import BAG_FOLDER

BAGS = (".bag", ".mcap", ".db3")
SHEETS = (".xlsx", ".xlsm")
_TRIED = 50  # cells that tell whether a column of text holds numbers or times
_DOTTED = re.compile(r"(\d{1,2})\.(\d{1,2})\.(\d{4})(?:[ T]+(\d{1,2})(:.*))?")
_YEARS = (1677, 2262)  # beyond, nanoseconds since 1970 are no int64
_BEYOND = "times before 1678 or after 2261"


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

    def named(self, names: Sequence[str]) -> Recording:
        """Give a recording that has no names these. Raises InputError where it has some, or another count.

        They stand for the file's columns from left to right.
        """
        own = [f"column_{number}" for number in range(1, len(self.names) + 1)]
        if set(own) != set(self.names):
            raise InputError(f"{self.path}: has names of its own, as {self.names[0]}; --map says what a column is")
        if len(names) != len(own) or len(set(names)) < len(own):
            raise InputError(f"{self.path}: has {len(own)} columns; --names gives {len(set(names))} different names")
        called = dict(zip(own, names, strict=True))
        note = f"{self.path}: has no line of names; they are those of --names"
        return replace(
            self,
            columns={called[name]: values for name, values in self.columns.items()},
            texts=tuple(called[name] for name in self.texts),
            units={called[name]: unit for name, unit in self.units.items()},
            said=(note, *self.said[1:]),
        )

    def place(self, sample: int) -> str:
        """Return what a message calls a sample, counted from 0."""
        return f"{self.counted} {sample + self.first}"


def read_recording(path: Path, robot: Robot, topics: Mapping[str, str]) -> Recording:
    """Read a log in whatever form it is. Raises InputError where it cannot be read."""
    from irtwin.bring.delimited_text import read_text
    from irtwin.bring.sage import is_motion, read_motion
    from irtwin.bring.spreadsheet import read_sheet

    suffix = path.suffix.lower()
    if suffix in (".urdf", ".xacro"):
        raise InputError(f"{path}: describes a robot, and is no log; give it by --robot, and name a log")
    if is_motion(path):
        return read_motion(path, robot)
    if path.is_dir() and not (path / BAG_FOLDER).exists():
        raise InputError(f"{path}: is a folder, and no bag of ROS 2; name the logs in it, as {path}/*.csv")
    if path.is_dir() or suffix in BAGS:
        return replace(_by_source(path, robot, topics), form="ROS bag", is_bag=True)
    if suffix in SHEETS:
        return read_sheet(path)
    if suffix in registered():
        return _by_source(path, robot, topics)
    return _parquet(path) if suffix == ".parquet" else read_text(path)


def as_columns(path: Path, table: pa.Table, places: tuple[str, int]) -> tuple[dict[str, np.ndarray], tuple[str, ...]]:
    """Return a table's columns of numbers and times, and the names of the others.

    A column of which most cells are numbers must have no other text; `places`: what a row is called, and the first
    one's number. Raises InputError, naming file, place and column.
    """
    names = [name.strip() for name in table.column_names]
    check_names(path, names)
    check_values(path, table.num_rows, len(names))
    columns: dict[str, np.ndarray] = {}
    for name, column in zip(names, table.columns, strict=True):
        values = _values(path, name, column, places)
        if values is not None:
            columns[name] = values
    return columns, tuple(name for name in names if name not in columns)


def _values(path: Path, name: str, column: pa.ChunkedArray, places: tuple[str, int]) -> np.ndarray | None:
    kind = column.type
    if is_text(kind):
        return _parsed(path, name, column, places)
    if pa.types.is_dictionary(kind):
        return _values(path, name, column.cast(kind.value_type), places)
    if pa.types.is_timestamp(kind) or pa.types.is_date(kind):
        return _instants(path, name, column)
    if pa.types.is_integer(kind) and column.null_count == 0:
        return np.asarray(column.to_numpy())  # whole: nanoseconds since 1970 are beyond a float
    if pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind):
        return np.asarray(pc.fill_null(column.cast(pa.float64(), safe=False), np.nan).to_numpy())
    if pa.types.is_null(kind):
        return np.full(len(column), np.nan)
    return None


def _instants(path: Path, name: str, column: pa.ChunkedArray) -> np.ndarray:
    try:
        return np.asarray(column.cast(pa.timestamp("ns")).to_numpy()).astype("datetime64[ns]")
    except pa.ArrowInvalid as error:
        raise InputError(f"{path}: column {name} has {_BEYOND}; correct it, or leave it out") from error


def _parsed(path: Path, name: str, column: pa.ChunkedArray, places: tuple[str, int]) -> np.ndarray | None:
    """Return a column of text as times or numbers; None where most of it is neither. Each text is read once."""
    if not pa.types.is_dictionary(column.type):
        column = column.dictionary_encode()
    encoded = column.unify_dictionaries().combine_chunks()
    encoded = encoded.chunk(0) if isinstance(encoded, pa.ChunkedArray) else encoded
    cells = [text.strip() for text in encoded.dictionary.to_pylist()]
    texts = np.array([*(None if cell.lower() in MISSING else cell for cell in cells), None], dtype=object)
    place = pc.fill_null(encoded.indices, len(cells)).to_numpy(zero_copy_only=False).astype(np.int64)
    known = np.array([text is not None for text in texts])[place]
    if not known.any():
        return np.full(len(place), np.nan)
    first = place[np.flatnonzero(known)[:_TRIED]]
    for parse, missing in ((_number, float("nan")), (_instant, np.datetime64("NaT"))):
        if sum(parse(texts[number]) is not None for number in first) * 2 <= len(first):
            continue
        read = [missing if text is None else parse(text) for text in texts]
        bad = np.array([value is None for value in read])[place]
        if bad.any():
            row = int(np.flatnonzero(bad)[0])
            raise InputError(
                f"{path}, {places[0]} {row + places[1]}, column {name}: {texts[place[row]][:40]!r} is no "
                f"{'number' if parse is _number else 'time'}; correct it, or leave the cell blank"
            )
        return np.asarray(np.array(read)[place])
    return None


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _instant(text: str) -> np.datetime64 | None:
    """Return a time of ISO 8601, or one whose date is written 2.3.2026, to the nanosecond; UTC where it has no zone."""
    from datetime import UTC, datetime

    if dotted := _DOTTED.fullmatch(text):
        day, month, year, hour, clock = dotted.groups()
        text = f"{year}-{month:0>2}-{day:0>2}" + (f"T{hour:0>2}{clock}" if hour else "")
    whole, sign, rest = text.replace(",", ".").partition(".")
    digits = rest[: next((place for place, sign in enumerate(rest) if not sign.isdecimal()), len(rest))]
    try:
        moment = datetime.fromisoformat(whole + rest[len(digits) :])
        zoned = moment if moment.tzinfo is None else moment.astimezone(UTC).replace(tzinfo=None)
    except (ValueError, OverflowError):  # before the year 1 in UTC
        return None
    if not _YEARS[0] < zoned.year < _YEARS[1]:
        return None
    return np.datetime64(zoned, "ns") + np.timedelta64(int((digits + "000000000")[:9]) if sign else 0, "ns")


def _parquet(path: Path) -> Recording:
    with open_parquet(path) as file:
        schema = file.schema_arrow
        # what is no one value a row is no signal: it is not read, for one row may hold millions
        names = [
            column.name for column in schema if not pa.types.is_nested(column.type) and not _is_binary(column.type)
        ]
        table = read_columns(path, file, names)
    columns, texts = as_columns(path, table, ("row", 1))
    read = set(names)
    others = [name.strip() for name in schema.names if name not in read]
    return Recording(path, "Parquet", columns, (*texts, *others))


def _is_binary(kind: pa.DataType) -> bool:
    return bool(pa.types.is_binary(kind) or pa.types.is_large_binary(kind) or pa.types.is_fixed_size_binary(kind))


def _by_source(path: Path, robot: Robot, topics: Mapping[str, str]) -> Recording:
    """Read a file by its source, which an installed package may have brought."""
    source = source_of(path, robot, topics)
    table, notes = source.read(source.columns(), repair=False)
    columns, texts = as_columns(path, table, (source.counted, source.first))
    form = f"{path.suffix.lower()}, by {type(source).__module__.partition('.')[0]}"
    return Recording(path, form, columns, texts, said=tuple(notes), first=source.first, counted=source.counted)
