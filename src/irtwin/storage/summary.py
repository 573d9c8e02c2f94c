"""What a series' Parquet file says of each of its row groups, so that a long window need not be read.

Kept in the file's own metadata, under its checksum: for every channel the sum, the least, the greatest and the integral
over time of each group. A window is then answered from the groups that lie inside it and the samples at its two ends.
"""

from __future__ import annotations

import json
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyarrow as pa

from irtwin.json_text import parse_json

ROW_GROUP = 122_880  # rows; DuckDB's own size: smaller ones cost it time, larger ones make the ends of a window long
KEY = b"irtwin.groups"

Floats = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Channel:
    """A channel over G row groups, each (G,): sum, least, greatest, first and last sample, and integral over time."""

    sum: Floats
    min: Floats
    max: Floats
    first: Floats
    last: Floats
    integral: Floats


@dataclass(frozen=True)
class Summary:
    """The row groups of a series: rows, and time of the first and last sample in s, each (G,); channels by name.

    A channel with a missing or infinite sample is left out: it has to be read.
    """

    rows: npt.NDArray[np.int64]
    begins: Floats
    ends: Floats
    channels: dict[str, Channel]


def with_summary(table: pa.Table) -> pa.Table:
    """Return the table with a summary in its metadata; without where its time does not rise from row to row."""
    time = _numbers(table, "time")
    if time is None or len(time) == 0 or not (np.diff(time) > 0).all():
        return table
    starts = np.arange(0, len(time), ROW_GROUP)
    ends = np.append(starts[1:], len(time)) - 1
    channels = {}
    for name in table.column_names:
        values = _numbers(table, name)
        if values is not None and name != "time":
            channels[name] = {key: part.tolist() for key, part in _channel(time, values, starts, ends).items()}
    content = {
        "rows": (ends - starts + 1).tolist(),
        "begins": time[starts].tolist(),
        "ends": time[ends].tolist(),
        "channels": channels,
    }
    return table.replace_schema_metadata({**(table.schema.metadata or {}), KEY: json.dumps(content).encode()})


def read_summary(schema: pa.Schema) -> Summary | None:
    """Return the summary that a file's schema holds, None where it holds none."""
    content = (schema.metadata or {}).get(KEY)
    if content is None:
        return None
    said = parse_json(content)
    channels = {
        name: Channel(**{key: np.array(part, dtype=np.float64) for key, part in channel.items()})
        for name, channel in said["channels"].items()
    }
    return Summary(np.array(said["rows"]), np.array(said["begins"]), np.array(said["ends"]), channels)


def _numbers(table: pa.Table, name: str) -> Floats | None:
    """Return a column's values, (N,); None where it is absent, holds no numbers, or lacks some."""
    if name not in table.column_names:
        return None
    column = table.column(name)
    numeric = pa.types.is_floating(column.type) or pa.types.is_integer(column.type)
    if not numeric or column.null_count:
        return None
    values = column.to_numpy().astype(np.float64, copy=False)
    return values if np.isfinite(values).all() else None


def _channel(
    time: Floats, values: Floats, starts: npt.NDArray[np.int64], ends: npt.NDArray[np.int64]
) -> dict[str, Floats]:
    parts = [(time[start : end + 1], values[start : end + 1]) for start, end in zip(starts, ends, strict=True)]
    return {
        "sum": np.array([part.sum() for _, part in parts]),
        "min": np.array([part.min() for _, part in parts]),
        "max": np.array([part.max() for _, part in parts]),
        "first": values[starts],
        "last": values[ends],
        "integral": np.array([np.trapezoid(part, moments) for moments, part in parts]),
    }
