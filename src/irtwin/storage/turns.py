"""Who rewrites the graph of a workspace: one process at a time, told by its database.

The graph may lie on a server that knows no locks, and rows lie where all who write to a workspace meet. A process that
is killed holds nothing any more: PostgreSQL lets go with its connection, the system with its file.
"""

from __future__ import annotations

import fcntl
import os
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from sqlalchemy import Engine, text

from irtwin.errors import InputError, WorkspaceFault
from irtwin.storage import engine as engines
from irtwin.storage.files import inside, is_locked

_KEY = 0x6972746772  # "irtgr": the advisory lock on PostgreSQL, beside that of writers of rows
_FILE = ".graph.turn"
_OPEN = os.O_WRONLY | os.O_CREAT | os.O_NONBLOCK  # a pipe in its place would be waited for without end
_AGAIN = 0.05  # s between two tries


@contextmanager
def rewriting_alone(engine: Engine, folder: Path) -> Iterator[None]:
    """Be the only process that rewrites the graph of the workspace in `folder` with this database.

    Raises WorkspaceFault where another one does so for longer than `engine.BUSY_TIMEOUT`.
    """
    with ExitStack() as held:
        turns = [_on_server(engine, held)] if engine.dialect.name == "postgresql" else []
        give_up = time.monotonic() + engines.BUSY_TIMEOUT
        for taken in (*turns, _in_folder(folder, held)):  # who reads the graph looks into the folder alone
            while not taken():
                if time.monotonic() > give_up:
                    raise WorkspaceFault(
                        f"{folder}: another process has been rewriting the graph for {engines.BUSY_TIMEOUT:g} s; "
                        "try again later, or stop `irtwin live`"
                    )
                time.sleep(_AGAIN)
        yield


def is_rewritten(folder: Path) -> bool:
    """Whether some process rewrites the graph of the workspace in `folder` just now."""
    return is_locked(inside(folder, _FILE))


def _on_server(engine: Engine, held: ExitStack) -> Callable[[], bool]:
    connection = held.enter_context(engine.connect().execution_options(isolation_level="AUTOCOMMIT"))
    held.callback(connection.invalidate)  # closes it, so that nothing is held that was not given back
    return lambda: bool(connection.scalar(text("SELECT pg_try_advisory_lock(:key)"), {"key": _KEY}))


def _in_folder(folder: Path, held: ExitStack) -> Callable[[], bool]:
    try:
        handle = os.open(inside(folder, _FILE), _OPEN, 0o666)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror}); {engines.TO_WRITE}") from None
    held.callback(os.close, handle)

    def taken() -> bool:
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        return True

    return taken
