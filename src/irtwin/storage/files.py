"""Files that are there whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from irtwin.errors import InputError


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
    """Write a file whole, replacing what was there. Raises InputError where it cannot be written."""
    try:
        with temporary_beside(path.parent) as temporary:
            temporary.write_bytes(content)
            put_in_place(temporary, path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror}); choose another place") from error


def check_place(path: Path) -> None:
    """Raise InputError where no file can be written, before the work whose result it is to hold."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder; name a file in it")
    folder = next(folder for folder in path.absolute().parents if folder.exists())
    if not (folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)):
        raise InputError(f"{path}: cannot be written, as {folder} is no folder that one may write to")


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
