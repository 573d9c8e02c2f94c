"""An SQLite database in a place where this user may only read.

Beside a database that is written by way of a log (WAL), SQLite keeps two files. Where they lie, it reads along with the
writer who made them. Where they do not, it would have to make them: then a copy is read, which nobody writes to.
Reading the file alone (`immutable`) would miss what is in the log, and see the halves of what is moved out of it.
"""

from __future__ import annotations

import os
import shutil
import sqlite3
import tempfile
import time
import weakref
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from urllib.parse import quote

from irtwin.errors import WorkspaceFault

_TRIES, _AGAIN = 50, 0.1  # s between two

Connect = Callable[[], sqlite3.Connection]


def may_only_be_read(file: Path) -> bool:
    """Whether a file is there, and it or its folder cannot be written by this user."""
    return file.is_file() and not all(os.access(place, os.W_OK) for place in (file, file.parent))


def connecting(file: Path) -> Connect:
    """Return what connects to the database, or to a copy of it. WorkspaceFault where it changes all the while."""
    in_place = _opening(file)
    for _ in range(_TRIES):
        try:
            with closing(in_place()) as connection:
                connection.execute("PRAGMA schema_version")
            return in_place
        except sqlite3.OperationalError:  # no log lies beside it, and none can be made
            copied = _copied(file)
            if copied is not None:
                return copied
        time.sleep(_AGAIN)
    raise WorkspaceFault(f"{file}: another process keeps changing it, and this user may only read it; try again later")


def _opening(file: Path) -> Connect:
    address = f"file:{quote(str(file.absolute()))}?mode=ro"
    return lambda: sqlite3.connect(address, uri=True, check_same_thread=False)


def _copied(file: Path) -> Connect | None:
    """Return what connects to a copy, which goes with it; None where the database changed while it was copied."""
    folder = tempfile.mkdtemp(prefix="irtwin-")
    connect = _opening(Path(folder) / file.name)
    weakref.finalize(connect, shutil.rmtree, folder, ignore_errors=True)
    before = _stamps(file)
    for part in before:
        shutil.copyfile(part, Path(folder) / part.name)
    return connect if _stamps(file) == before else None


def _stamps(file: Path) -> dict[Path, tuple[int, int]]:
    """Return size and time of change of a database's file and of its log, where that is there."""
    stamps = {}
    for part in (file, file.with_name(f"{file.name}-wal")):
        if part.exists():
            status = part.stat()
            stamps[part] = status.st_size, status.st_mtime_ns
    return stamps
