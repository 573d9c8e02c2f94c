"""Series of samples as Parquet files named by their content, in a workspace's folder or in object storage.

A path is relative to the workspace, and the same wherever the file is: `series/CHECKSUM.parquet`.
"""

from __future__ import annotations

import hashlib
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

from irtwin.errors import InputError
from irtwin.input_file import checksum
from irtwin.storage import files
from irtwin.storage.files import inside
from irtwin.storage.object_storage import ObjectStorage, StorageFault
from irtwin.storage.series_place import choose, elsewhere

FOLDER = "series"
ROW_GROUP = 122_880  # rows; DuckDB's own size, of which it reads those that a window needs


@dataclass(frozen=True)
class SeriesFile:
    """A stored Parquet file; `path` is relative to the workspace, `series_id` the file's sha256."""

    series_id: str
    path: str
    row_count: int
    columns: tuple[str, ...]


def write_series(workspace: Path, table: pa.Table) -> SeriesFile:
    """Store a table, once: the same content has the same name."""
    storage = elsewhere(workspace)
    folder = workspace / FOLDER if storage is None else Path(tempfile.gettempdir())
    with files.temporary_beside(folder) as temporary:
        pq.write_table(table, temporary, compression="zstd", row_group_size=ROW_GROUP)
        series_id = checksum(temporary)
        path = f"{FOLDER}/{series_id}.parquet"
        if storage is not None:
            storage.put({path: temporary})
        elif not (file := inside(workspace, path)).exists():
            files.put_in_place(temporary, file)
    return SeriesFile(series_id, path, table.num_rows, tuple(table.column_names))


def read_series(workspace: Path, path: str, series_id: str, columns: Sequence[str] | None = None) -> pa.Table:
    """Read a series, or some of its columns, after its checksum was verified.

    Raises InputError where the file lies outside the workspace, is missing or was altered, or cannot be reached.
    """
    file = inside(workspace, path)
    chosen = None if columns is None else list(columns)
    storage = storage_of(workspace, path)
    if storage is not None:
        content = storage.content(path)
        if content is None:
            raise InputError(f"{storage.address(path)}: the series is missing; ingest the data set again")
        if hashlib.sha256(content).hexdigest() != series_id:
            raise InputError(_altered(storage.address(path)))
        return pq.read_table(pa.BufferReader(content), columns=chosen)
    if not file.is_file():
        raise InputError(f"{file}: the series is missing; ingest the data set again")
    if checksum(file) != series_id:
        raise InputError(_altered(file))
    return pq.read_table(file, columns=chosen)


def is_whole(workspace: Path, path: str, sha256: str) -> bool:
    """Whether a file of the workspace is there and is what was written."""
    file = inside(workspace, path)
    storage = storage_of(workspace, path)
    if storage is not None:
        return storage.checksum(path) == sha256
    return file.is_file() and checksum(file) == sha256


def storage_of(workspace: Path, path: str) -> ObjectStorage | None:
    """Return the object storage that holds a file of a workspace; None where the folder does."""
    return elsewhere(workspace) if is_series(path) else None


def is_series(path: str) -> bool:
    """Whether a file of a workspace is a series."""
    return path.startswith(f"{FOLDER}/")


def fetch_series(storage: ObjectStorage, folder: Path, paths: Iterable[str]) -> None:
    """Bring series from object storage into a folder, those that it does not have."""
    (folder / FOLDER).mkdir(parents=True, exist_ok=True)
    lacking = (path for path in paths if not (folder / path).exists())
    storage.fetch({path: inside(folder, path) for path in lacking})


@contextmanager
def moved_out(workspace: Path, url: str | None) -> Iterator[None]:
    """Move the series of a folder into object storage, if a URL is given; undone where the block does not end well."""
    if url is None:
        yield
        return
    choose(workspace, url, has_series=False)
    storage = elsewhere(workspace)
    assert storage is not None
    moved = {f"{FOLDER}/{file.name}": file for file in (workspace / FOLDER).glob("[!.]*")}
    try:
        storage.put(moved)
        yield
    except BaseException:
        with suppress(StorageFault):  # what is wrong was said
            storage.remove(storage.paths(FOLDER))
            storage.release()
        raise
    shutil.rmtree(workspace / FOLDER, ignore_errors=True)


def _altered(file: Path | str) -> str:
    return f"{file}: the series was altered, its checksum differs; delete it and ingest again"
