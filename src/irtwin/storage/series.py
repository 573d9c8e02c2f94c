"""Series of samples as Parquet files of a workspace, named by their content: `series/CHECKSUM.parquet`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from irtwin.errors import InputError
from irtwin.input_file import checksum
from irtwin.storage import files
from irtwin.storage.files import inside

FOLDER = "series"
ROW_GROUP = 122_880  # rows; those are read that a window needs


def write_series(workspace: Path, table: pa.Table) -> tuple[str, str]:
    """Store a table, once: the same content has the same name. Return its path in the workspace, and its SHA-256."""
    with files.temporary_beside(workspace / FOLDER) as temporary:
        pq.write_table(table, temporary, compression="zstd", row_group_size=ROW_GROUP)
        series_id = checksum(temporary)
        path = f"{FOLDER}/{series_id}.parquet"
        if not (file := inside(workspace, path)).exists():
            files.put_in_place(temporary, file)
    return path, series_id


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
