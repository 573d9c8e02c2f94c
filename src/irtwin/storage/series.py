"""Series of samples as Parquet files named by their content."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from irtwin.errors import InputError
from irtwin.storage import files
from irtwin.storage.summary import ROW_GROUP, with_summary

FOLDER = "series"


@dataclass(frozen=True)
class SeriesFile:
    """A stored Parquet file; `path` is relative to the workspace, `series_id` the file's sha256."""

    series_id: str
    path: str
    row_count: int
    columns: tuple[str, ...]


def write_series(workspace: Path, table: pa.Table) -> SeriesFile:
    """Store a table, once: the same content has the same name."""
    folder = workspace / FOLDER
    with files.temporary_beside(folder) as temporary:
        pq.write_table(with_summary(table), temporary, compression="zstd", row_group_size=ROW_GROUP)
        series_id = checksum(temporary)
        path = folder / f"{series_id}.parquet"
        if not path.exists():
            files.put_in_place(temporary, path)
    return SeriesFile(series_id, f"{FOLDER}/{path.name}", table.num_rows, tuple(table.column_names))


def read_series(workspace: Path, path: str, series_id: str, columns: Sequence[str] | None = None) -> pa.Table:
    """Read a series, or some of its columns, after its checksum was verified.

    Raises InputError where the file lies outside the workspace, is missing or was altered.
    """
    file = inside(workspace, path)
    if not file.is_file():
        raise InputError(f"{file}: the series is missing; ingest the data set again")
    if checksum(file) != series_id:
        raise InputError(f"{file}: the series was altered, its checksum differs; delete it and ingest again")
    return pq.read_table(file, columns=None if columns is None else list(columns))


def is_whole(workspace: Path, path: str, sha256: str) -> bool:
    """Whether a file of the workspace is there and is what was written."""
    file = inside(workspace, path)
    return file.is_file() and checksum(file) == sha256


def checksum(file: Path) -> str:
    """Return the sha256 of a file's bytes, in hexadecimal."""
    with file.open("rb") as stream:
        return hashlib.file_digest(stream, "sha256").hexdigest()


def inside(workspace: Path, path: str) -> Path:
    """Return the file that a workspace's relative path means; InputError where it leads outside."""
    file = (workspace / path).resolve()
    if not file.is_relative_to(workspace.resolve()):
        raise InputError(f"{workspace}: the path {path!r} leads outside the workspace; nothing was read or written")
    return file
