"""A folder of links to the files of another: they stay when their owner removes them, as in RocksDB's checkpoints."""

from __future__ import annotations

import fcntl
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

_PREFIX = ".view-"


@contextmanager
def linked(folder: Path, *ignored: str) -> Iterator[Path]:
    """Give a folder beside another, with links to its files but those whose names start with one of `ignored`.

    It is locked, so that nobody takes it for left behind. OSError where a file goes while it is linked.
    """
    with tempfile.TemporaryDirectory(prefix=_PREFIX, dir=folder.parent, ignore_cleanup_errors=True) as name:
        lock = os.open(name, os.O_RDONLY)
        try:
            fcntl.flock(lock, fcntl.LOCK_EX)
            for file in folder.iterdir():
                if not file.name.startswith(ignored):
                    os.link(file, Path(name) / file.name)
            yield Path(name)
        finally:
            os.close(lock)


def remove_left_behind(folder: Path) -> None:
    """Remove the links that killed processes left beside a folder."""
    for left in folder.parent.glob(f"{_PREFIX}*"):
        with suppress(OSError):  # it is in use, or another process removes it just now
            lock = os.open(left, os.O_RDONLY)
            try:
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                shutil.rmtree(left)
            finally:
                os.close(lock)
