"""Files that are there whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


@contextmanager
def temporary_beside(folder: Path) -> Iterator[Path]:
    """Give the path of a new file in the folder, which is gone at the end unless it was renamed."""
    folder.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=".", suffix=".tmp", dir=folder)
    os.close(handle)
    path = Path(name)
    path.chmod(0o644)
    try:
        yield path
    finally:
        path.unlink(missing_ok=True)


def put_in_place(temporary: Path, path: Path) -> None:
    """Give a finished file its name; the disk holds it when this returns."""
    _sync(temporary)
    temporary.replace(path)
    _sync(path.parent)


def write(path: Path, content: bytes) -> None:
    """Write a file whole, replacing what was there."""
    with temporary_beside(path.parent) as temporary:
        temporary.write_bytes(content)
        put_in_place(temporary, path)


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
