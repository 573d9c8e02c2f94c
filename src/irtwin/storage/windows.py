"""Channels of a series over a window of its time, read by DuckDB: two columns, and the row groups that are needed."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.parquet as pq

from irtwin.errors import InputError
from irtwin.packing import extremes
from irtwin.storage.files import inside

if TYPE_CHECKING:
    import duckdb  # a tenth of a second to import, for those who ask for samples

MOST_SAMPLES = 10_000
MOST_DRAWN = 2_000  # of a curve: more than a screen is wide
Extreme = Literal["min", "max"]
Floats = npt.NDArray[np.float64]


class SeriesWindows:
    """A stored series, asked for windows. Times are those of its column `time`, in s; a window holds its both ends.

    Missing and infinite samples count for nothing. Every question raises InputError for a channel that the file does
    not have, and answers None where the window holds no sample.
    """

    def __init__(self, file: Path) -> None:
        """Read a file's metadata. InputError where there is no such file, or it is damaged."""
        self._file = str(file)
        if not file.is_file():
            raise InputError(f"{file}: the series is missing; ingest the data set again")
        try:
            told = pq.read_metadata(file)
            names = told.schema.to_arrow_schema().names
            time, count = names.index("time"), told.num_row_groups
            groups = [told.row_group(number).column(time).statistics for number in range(count)]
            self._groups = [(float(group.min), float(group.max)) for group in groups]  # s, of the row groups
        except (pa.ArrowException, OSError, ValueError, AttributeError) as error:
            raise InputError(_damaged(self._file)) from error
        self.channels = tuple(name for name in names if name != "time")

    @cached_property
    def begin(self) -> float:
        """Time of the first sample, s."""
        (first,) = self._fetch(lambda: self._run("SELECT min(time) FROM read_parquet(?)").fetchone())
        return float(first)

    def mean(self, channel: str, start: float, end: float) -> float | None:
        """Return the mean of the samples in a window."""
        return self._number("fsum(value) / nullif(count(value), 0)", channel, start, end)

    def extreme(self, which: Extreme, channel: str, start: float, end: float) -> float | None:
        """Return the least or the greatest sample in a window."""
        return self._number(f"{which}(value)", channel, start, end)

    def integral(self, channel: str, start: float, end: float) -> float | None:
        """Return the integral over time by the trapezoidal rule, channel's unit times s, over what of it was recorded.

        Between samples the channel is a straight line, also where the window begins and ends: integrals add up.
        """
        time, values = self._samples(channel, self._before(channel, start), self._after(channel, end))
        if len(time) == 0:
            return None
        start, end = max(start, time[0]), min(end, time[-1])
        return None if start > end else _until(time, values, end) - _until(time, values, start)

    def samples(self, channel: str, start: float, end: float) -> list[tuple[float, float]]:
        """Return time and value of the samples in a window. Raises InputError for more than `MOST_SAMPLES`."""
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
        time, values = self._samples(channel, start, end)
        kept = extremes([values], MOST_DRAWN) if len(time) else slice(0)
        return [
            (at, float(f"{value:.7g}")) for at, value in zip(time[kept].tolist(), values[kept].tolist(), strict=True)
        ]

    def _before(self, channel: str, at: float) -> float:
        """Return the time of the last sample up to a moment, that moment where there is none."""
        near = max((begin for begin, _ in self._groups if begin <= at), default=at)  # else all groups would be read
        time = self._number("max(time)", channel, near, at) or self._number("max(time)", channel, -np.inf, at)
        return at if time is None else time

    def _after(self, channel: str, at: float) -> float:
        """Return the time of the first sample from a moment on, likewise."""
        near = min((end for _, end in self._groups if end >= at), default=at)
        time = self._number("min(time)", channel, at, near) or self._number("min(time)", channel, at, np.inf)
        return at if time is None else time

    def _number(self, what: str, channel: str, start: float, end: float) -> float | None:
        """Return a number of a window's samples, None where it holds none."""
        text = f"SELECT {what} FROM ({self._samples_of(channel)})"
        (number,) = self._fetch(lambda: self._run(text, float(start), float(end)).fetchone())
        return None if number is None else float(number)

    def _samples(self, channel: str, start: float, end: float, most: int | None = None) -> tuple[Floats, Floats]:
        limit = "" if most is None else f" LIMIT {most}"
        text = f"{self._samples_of(channel)}{limit}"  # in the order of the file, which is that of time
        columns: dict[str, Any] = self._fetch(lambda: self._run(text, float(start), float(end)).fetchnumpy())
        return columns["time"], columns["value"].astype(np.float64, copy=False)

    def _samples_of(self, channel: str) -> str:
        """Return the query of a window's samples. InputError where there is no such channel."""
        if channel not in self.channels:
            raise InputError(f"there is no channel {channel!r}; there are {', '.join(self.channels)}")
        value = '"' + channel.replace('"', '""') + '"::DOUBLE'  # of yes and no, 1 and 0
        return f"SELECT time, {value} AS value FROM read_parquet(?) WHERE time BETWEEN ? AND ? AND isfinite({value})"

    def _fetch(self, ask: Callable[[], Any]) -> Any:
        """Return what a query finds. Raises InputError where the file is damaged."""
        import duckdb

        try:
            return ask()
        except duckdb.Error as error:
            raise InputError(_damaged(self._file)) from error

    def _run(self, text: str, *values: float) -> duckdb.DuckDBPyConnection:
        return _connection().execute(text, [self._file, *values])


def _damaged(file: str) -> str:
    return f"{file}: the series is damaged; run its data set again"


@lru_cache(maxsize=256)
def open_series(workspace: Path, path: str) -> SeriesWindows:
    """Return a series by its path in a workspace, which says its content: it never becomes another."""
    return SeriesWindows(inside(workspace, path))


@lru_cache(maxsize=1)
def _database() -> duckdb.DuckDBPyConnection:
    import duckdb

    return duckdb.connect(config={"autoload_known_extensions": False, "autoinstall_known_extensions": False})


def _connection() -> duckdb.DuckDBPyConnection:
    return _database().cursor()  # one for each thread


def _until(time: Floats, values: Floats, at: float) -> float:
    """Return the integral from the first sample to a moment between two samples."""
    stop = int(np.searchsorted(time, at, side="right"))
    end = np.interp(at, time, values)
    return float(np.trapezoid(np.append(values[:stop], end), np.append(time[:stop], at)))
