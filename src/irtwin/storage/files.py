"""Files that are there whole or not at all."""

from __future__ import annotations

import errno
import fcntl
import hashlib
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import NewType

from irtwin.errors import InputError, WorkspaceFault
from irtwin.input_file import real_path

InsidePath = NewType("InsidePath", Path)  # of a file in a workspace: what `inside` returns, and nobody else makes one

_FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)


@contextmanager
def told_when_full(place: Path) -> Iterator[None]:
    """Raise WorkspaceFault where the disk takes no more; other errors pass."""
    try:
        yield
    except OSError as error:
        if error.errno not in _FULL:
            raise
        raise WorkspaceFault(f"{place}: cannot be written ({error.strerror}); free some space and try again") from error


@contextmanager
def temporary_beside(folder: Path) -> Iterator[Path]:
    """Give the path of a new file in the folder, which is gone at the end unless it was renamed."""
    folder.mkdir(parents=True, exist_ok=True)
    handle, name = tempfile.mkstemp(prefix=".", suffix=".tmp", dir=folder)
    os.close(handle)
    path = Path(name)
    path.chmod(0o644)
    try:
        with told_when_full(folder):
            yield path
    finally:
        path.unlink(missing_ok=True)


@contextmanager
def working_folder(parent: Path, prefix: str) -> Iterator[Path]:
    """Give a new folder, gone at the end; those of the same prefix that killed processes left go too."""
    remove_left_behind(parent, prefix)
    with folder_in_use(parent, prefix) as folder:
        yield folder


@contextmanager
def folder_in_use(parent: Path, prefix: str) -> Iterator[Path]:
    """Give a new folder, gone at the end, and locked until then: so nobody takes it for left behind."""
    with (
        told_when_full(parent),
        tempfile.TemporaryDirectory(prefix=prefix, dir=parent, ignore_cleanup_errors=True) as name,
        locked(Path(name), fcntl.LOCK_EX),
    ):
        yield Path(name)


def remove_left_behind(parent: Path, prefix: str) -> None:
    """Remove the folders of a prefix that killed processes left."""
    for left in parent.glob(f"{prefix}*"):
        with suppress(OSError), locked(left):  # else it is in use
            shutil.rmtree(left)


@contextmanager
def locked(folder: Path, how: int = fcntl.LOCK_EX | fcntl.LOCK_NB) -> Iterator[None]:
    """Hold a folder's lock. BlockingIOError where another process does, if that is not to be waited for."""
    handle = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(handle, how)
        yield
    finally:
        os.close(handle)


def is_locked(path: Path) -> bool:
    """Whether a process holds the lock of a file or folder; several may look at once."""
    try:
        handle = os.open(path, os.O_RDONLY | os.O_NONBLOCK)  # a pipe in its place would be waited for without end
    except FileNotFoundError:
        return False
    try:
        fcntl.flock(handle, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    finally:
        os.close(handle)
    return False


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
        raise InputError(f"{path}: is a folder; name a file")
    folder = next(folder for folder in path.absolute().parents if folder.exists())
    if not (folder.is_dir() and os.access(folder, os.W_OK | os.X_OK)):
        raise InputError(f"{path}: cannot be written, because {folder} is not a writable folder")


def check_new(path: Path) -> None:
    """Raise InputError where no model can be written: one that is there may be somebody's work."""
    check_place(path)
    if path.exists():
        raise InputError(f"{path}: is there already, and no model is written over; remove it, or name another")


def read_document(folder: Path, path: str, checksum: str) -> bytes:
    """Read a file of a workspace by its path and SHA-256. Raises InputError where it is gone or another."""
    again = "run or diagnose its data set again"
    try:
        content = inside(folder, path).read_bytes()
    except OSError as error:
        raise InputError(f"{folder / path}: cannot be read ({error.strerror}); {again}") from None
    if hashlib.sha256(content).hexdigest() != checksum:
        raise InputError(f"{folder / path}: was changed after it was written; {again}")
    return content


def _sync(path: Path) -> None:
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)


def inside(workspace: Path, path: str) -> InsidePath:
    """Return the file that a workspace's relative path means; InputError where it, or a link on its way, leads outside.

    The one gate for what rows, archives and file names say: a database, or a whole folder, may come from elsewhere.
    """
    real = real_path(workspace / path)
    if real is None or not real.is_relative_to(workspace.resolve()):
        raise InputError(
            f"{workspace}: the path {path[:200]!r} leads outside the workspace; nothing was read or written"
        )
    return InsidePath(workspace / path)


def remove(file: InsidePath) -> None:
    """Remove a file of a workspace, if it is there."""
    file.unlink(missing_ok=True)
