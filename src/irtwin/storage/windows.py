"""Channels of a series over a window of its time: two columns are read, of the row groups that are needed."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from irtwin.errors import InputError
from irtwin.packing import extremes
from irtwin.storage.files import inside

MOST_SAMPLES = 10_000
MOST_DRAWN = 2_000  # of a curve: more than a screen is wide
Floats = npt.NDArray[np.float64]


class SeriesWindows:
    """A stored series, asked for windows. Times are those of its column `time`, in s; a window holds its both ends.

    Missing and infinite samples count for nothing. Every question raises InputError for a channel that the file does
    not have, and answers None where the window holds no sample.
    """

    def __init__(self, file: Path) -> None:
        """Read a file's metadata. InputError where there is no such file, or it is damaged."""
        self._file = file
        if not file.is_file():
            raise InputError(f"{file}: the series is missing; ingest the data set again")
        try:
            self._metadata = pq.read_metadata(file)
            names = self._metadata.schema.to_arrow_schema().names
            time, count = names.index("time"), self._metadata.num_row_groups
            groups = [self._metadata.row_group(number).column(time).statistics for number in range(count)]
            self._groups = [(float(group.min), float(group.max)) for group in groups]  # s, of the row groups
            self.begin = self._groups[0][0]  # time of the first sample, s
        except (pa.ArrowException, OSError, ValueError, AttributeError, IndexError) as error:
            raise self._damaged() from error
        self.channels = tuple(name for name in names if name != "time")

    def mean(self, channel: str, start: float, end: float) -> float | None:
        """Return the mean of the samples in a window."""
        pieces = [values for _, values in self._pieces(channel, start, end)]
        count = sum(map(len, pieces))
        return math.fsum(float(values.sum()) for values in pieces) / count if count else None

    def min(self, channel: str, start: float, end: float) -> float | None:
        """Return the least sample in a window."""
        return min((float(values.min()) for _, values in self._pieces(channel, start, end)), default=None)

    def max(self, channel: str, start: float, end: float) -> float | None:
        """Return the greatest sample in a window."""
        return max((float(values.max()) for _, values in self._pieces(channel, start, end)), default=None)

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
        time, values = self._samples(channel, start, end)
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
        groups = [number for number, (begin, _) in enumerate(self._groups) if begin <= at]
        return next((float(time[-1]) for time, _ in self._read(channel, reversed(groups), -np.inf, at)), at)

    def _after(self, channel: str, at: float) -> float:
        """Return the time of the first sample from a moment on, likewise."""
        groups = [number for number, (_, end) in enumerate(self._groups) if end >= at]
        return next((float(time[0]) for time, _ in self._read(channel, groups, at, np.inf)), at)

    def _samples(self, channel: str, start: float, end: float) -> tuple[Floats, Floats]:
        pieces = [(np.empty(0), np.empty(0)), *self._pieces(channel, start, end)]
        time, values = map(np.concatenate, zip(*pieces, strict=True))
        return time, values

    def _pieces(self, channel: str, start: float, end: float) -> Iterator[tuple[Floats, Floats]]:
        """Yield times and values of a window's samples, (N,) each, by row groups."""
        groups = [number for number, (begin, last) in enumerate(self._groups) if begin <= end and last >= start]
        return self._read(channel, groups, start, end)

    def _read(self, channel: str, groups: Iterable[int], start: float, end: float) -> Iterator[tuple[Floats, Floats]]:
        """Yield the samples of those row groups that have any in a window, as `_pieces`.

        InputError for a channel that is not there, or a damaged file.
        """
        if channel not in self.channels:
            raise InputError(f"there is no channel {channel!r}; there are {', '.join(self.channels)}")
        try:
            with pq.ParquetFile(self._file, metadata=self._metadata) as file:
                for group in groups:
                    table = file.read_row_group(group, ["time", channel], use_threads=False)
                    time, values = (pc.cast(table[name], pa.float64()).to_numpy() for name in ("time", channel))
                    kept = (time >= start) & (time <= end) & np.isfinite(values)
                    if kept.any():
                        yield time[kept], values[kept]
        except (pa.ArrowException, OSError) as error:
            raise self._damaged() from error

    def _damaged(self) -> InputError:
        return InputError(f"{self._file}: the series is damaged; run its data set again")


@lru_cache(maxsize=256)
def open_series(workspace: Path, path: str) -> SeriesWindows:
    """Return a series by its path in a workspace, which says its content: it never becomes another."""
    return SeriesWindows(inside(workspace, path))


def _until(time: Floats, values: Floats, at: float) -> float:
    """Return the integral from the first sample to a moment between two samples."""
    stop = int(np.searchsorted(time, at, side="right"))
    end = np.interp(at, time, values)
    return float(np.trapezoid(np.append(values[:stop], end), np.append(time[:stop], at)))
