"""Channels of a series over a window of its time, read by DuckDB: two columns, and the row groups that are needed."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property, lru_cache
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any, Literal

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from irtwin.errors import InputError
from irtwin.packing import extremes
from irtwin.storage.files import inside
from irtwin.storage.object_storage import ObjectStorage
from irtwin.storage.series import storage_of
from irtwin.storage.summary import Channel, Floats, Summary, read_summary

if TYPE_CHECKING:
    import duckdb  # a tenth of a second to import, for those who ask for samples

MOST_SAMPLES = 10_000
MOST_DRAWN = 2_000  # of a curve: more than a screen is wide
Extreme = Literal["min", "max"]


class SeriesWindows:
    """A stored series, asked for windows. Times are those of its column `time`, in s; a window holds its both ends.

    Missing and infinite samples count for nothing. Every question raises InputError for a channel that the file does
    not have, and answers None where the window holds no sample.
    """

    def __init__(self, file: Path | str, storage: ObjectStorage | None = None) -> None:
        """Read a file's metadata, or an object's by its path. InputError where there is none, or it is damaged."""
        self._file = str(file) if storage is None else storage.address(str(file))
        self._storage = storage
        with _opened(file, storage) as content:
            if content is None:
                raise InputError(f"{self._file}: the series is missing; ingest the data set again")
            try:
                schema = pq.read_schema(content)
                self._summary = read_summary(schema)
            except (pa.ArrowException, OSError, ValueError, KeyError, TypeError) as error:
                raise InputError(_damaged(self._file)) from error
        self.channels = tuple(name for name in schema.names if name != "time")

    @cached_property
    def begin(self) -> float:
        """Time of the first sample, s."""
        if self._summary is not None:
            return float(self._summary.begins[0])
        first = self._fetch(lambda: self._run("SELECT min(time) FROM read_parquet(?)").fetchall())
        return float(first[0][0])

    def mean(self, channel: str, start: float, end: float) -> float | None:
        """Return the mean of the samples in a window."""
        count, total, _, _ = self._totals(channel, start, end)
        return total / count if count else None

    def extreme(self, which: Extreme, channel: str, start: float, end: float) -> float | None:
        """Return the least or the greatest sample in a window."""
        count, _, least, greatest = self._totals(channel, start, end)
        return (least if which == "min" else greatest) if count else None

    def integral(self, channel: str, start: float, end: float) -> float | None:
        """Return the integral over time by the trapezoidal rule, channel's unit times s, over what of it was recorded.

        Between samples the channel is a straight line, also where the window begins and ends: integrals add up.
        """
        known = self._known(channel)
        if known is not None:
            summary, groups = known
            first, last = summary.begins[0], summary.ends[-1]
            return _between(first, last, start, end, lambda at: self._until(at, channel, groups))
        time, values = self._samples(channel, -np.inf, np.inf)
        if len(time) == 0:
            return None
        return _between(time[0], time[-1], start, end, lambda at: _until(time, values, at))

    def samples(self, channel: str, start: float, end: float) -> list[tuple[float, float]]:
        """Return time and value of the samples in a window. Raises InputError for more than `MOST_SAMPLES`."""
        self._check(channel)
        time, values = self._samples(channel, start, end, MOST_SAMPLES + 1)
        if len(time) > MOST_SAMPLES:
            raise InputError(
                f"the window holds more than {MOST_SAMPLES:,} samples: give a shorter window, or ask for the mean"
            )
        return list(zip(time.tolist(), values.tolist(), strict=True))

    def curve(self, channel: str, start: float, end: float) -> list[tuple[float, float]]:
        """Return time and value of at most `MOST_DRAWN` samples in a window, in order, for the eye.

        Of more, it is the least and the greatest of each of as many equal parts as fit; values have seven digits.
        """
        self._check(channel)
        time, values = self._samples(channel, start, end)
        kept = extremes([values], MOST_DRAWN) if len(time) else slice(0)
        return [
            (at, float(f"{value:.7g}")) for at, value in zip(time[kept].tolist(), values[kept].tolist(), strict=True)
        ]

    def _totals(self, channel: str, start: float, end: float) -> tuple[int, float, float, float]:
        """Return count, sum, least and greatest of a window's samples."""
        ranges, whole = [(start, end)], slice(0)
        known = self._known(channel)
        if known is not None:
            summary, groups = known
            first, stop = np.searchsorted(summary.begins, start), np.searchsorted(summary.ends, end, side="right")
            whole = slice(int(first), int(stop))
            if whole.start < whole.stop:  # read what lies before and after the groups that are inside
                ranges = [(start, np.nextafter(summary.begins[whole.start], -np.inf))]
                ranges += [(np.nextafter(summary.ends[whole.stop - 1], np.inf), end)]
        count, total, least, greatest = self._read_totals(channel, ranges)
        if known is None or whole.start >= whole.stop:
            return count, total, least, greatest
        return (
            count + int(summary.rows[whole].sum()),
            total + float(groups.sum[whole].sum()),
            min(least, float(groups.min[whole].min())),
            max(greatest, float(groups.max[whole].max())),
        )

    def _read_totals(self, channel: str, ranges: list[tuple[float, float]]) -> tuple[int, float, float, float]:
        one = self._samples_of(channel)
        extremes = "coalesce(min(value)::DOUBLE, 'inf'), coalesce(max(value)::DOUBLE, '-inf')"
        edges = " UNION ALL ".join([one] * len(ranges))
        text = f"SELECT count(value), coalesce(fsum(value), 0), {extremes} FROM ({edges})"
        values = [value for edge in ranges for value in (self._file, *map(float, edge))]
        count, total, least, greatest = self._fetch(lambda: _connection().execute(text, values).fetchall())[0]
        return int(count), float(total), float(least), float(greatest)

    def _until(self, at: float, channel: str, groups: Channel) -> float:
        """Return the integral from the first sample to a moment that was recorded."""
        assert self._summary is not None
        begins, ends = self._summary.begins, self._summary.ends
        group = int(np.searchsorted(begins, at, side="right")) - 1
        bridges = (begins[1:] - ends[:-1]) * (groups.first[1:] + groups.last[:-1]) / 2  # from group to group
        before = float(groups.integral[:group].sum() + bridges[:group].sum())
        time, values = self._samples(channel, begins[group], ends[group])
        following = slice(group + 1, group + 2)
        return before + _until(np.append(time, begins[following]), np.append(values, groups.first[following]), at)

    def _samples(self, channel: str, start: float, end: float, most: int | None = None) -> tuple[Floats, Floats]:
        limit = "" if most is None else f" LIMIT {most}"
        text = f"{self._samples_of(channel)}{limit}"  # in the order of the file, which is that of time
        found: dict[str, Any] = self._fetch(lambda: self._run(text, float(start), float(end)).fetchnumpy())
        return found["time"], found["value"].astype(np.float64, copy=False)

    def _samples_of(self, channel: str) -> str:
        """Return the query of a window's samples; those of a channel with a summary are all finite."""
        value = '"' + channel.replace('"', '""') + '"::DOUBLE'  # of yes and no, 1 and 0
        finite = "" if self._known(channel) else f" AND isfinite({value})"
        return f"SELECT time, {value} AS value FROM read_parquet(?) WHERE time BETWEEN ? AND ?{finite}"

    def _known(self, channel: str) -> tuple[Summary, Channel] | None:
        self._check(channel)
        groups = None if self._summary is None else self._summary.channels.get(channel)
        return None if self._summary is None or groups is None else (self._summary, groups)

    def _check(self, channel: str) -> None:
        if channel not in self.channels:
            raise InputError(f"there is no channel {channel!r}; there are {', '.join(self.channels)}")

    def _fetch(self, ask: Callable[[], Any]) -> Any:
        """Return what a query finds. Raises InputError where the file is damaged."""
        import duckdb

        try:
            return ask()
        except duckdb.Error as error:
            if self._storage is not None:
                self._storage.owner()  # says so where the storage cannot be reached
            raise InputError(_damaged(self._file)) from error

    def _run(self, text: str, *values: float) -> duckdb.DuckDBPyConnection:
        return _connection().execute(text, [self._file, *values])


def _damaged(file: str) -> str:
    return f"{file}: the series is damaged; run its data set again"


@lru_cache(maxsize=256)
def open_series(workspace: Path, path: str) -> SeriesWindows:
    """Return a series by its path in a workspace, which says its content: it never becomes another."""
    file, storage = inside(workspace, path), storage_of(workspace, path)
    if storage is None:
        return SeriesWindows(file)
    _let_read(storage)
    return SeriesWindows(path, storage)


@contextmanager
def _opened(file: Path | str, storage: ObjectStorage | None) -> Iterator[Path | IO[bytes] | None]:
    """Give what pyarrow reads a series from; None where there is none."""
    if storage is None:
        there = Path(file)
        yield there if there.is_file() else None
    else:
        with storage.opened(str(file)) as stream:
            yield stream


@lru_cache(maxsize=1)
def _database() -> duckdb.DuckDBPyConnection:
    import duckdb

    return duckdb.connect(config={"autoload_known_extensions": False, "autoinstall_known_extensions": False})


def _let_read(storage: ObjectStorage) -> None:
    """Let DuckDB read objects, only the parts that it needs."""
    if "s3" not in _database().list_filesystems():
        _database().register_filesystem(storage.files)


def _connection() -> duckdb.DuckDBPyConnection:
    return _database().cursor()  # one for each thread


def _between(first: float, last: float, start: float, end: float, until: Any) -> float | None:
    start, end = max(start, first), min(end, last)
    return None if start > end else float(until(end) - until(start))


def _until(time: Floats, values: Floats, at: float) -> float:
    """Return the integral from the first sample to a moment between two samples."""
    stop = int(np.searchsorted(time, at, side="right"))
    end = np.interp(at, time, values)
    return float(np.trapezoid(np.append(values[:stop], end), np.append(time[:stop], at)))
