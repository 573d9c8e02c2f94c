"""What the store raises about its files, told in one line that says what to do."""

from __future__ import annotations

import errno
import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import wraps
from pathlib import Path
from typing import Any, TypeVar, cast

from irtwin.errors import WorkspaceFault
from irtwin.knowledge.store import store_files

Method = TypeVar("Method", bound=Callable[..., Any])

_FULL = [os.strerror(number) for number in (errno.ENOSPC, errno.EFBIG, errno.EDQUOT)]


@contextmanager
def told(folder: Path | None) -> Iterator[None]:
    """Raise WorkspaceFault where the store of a folder is damaged, or its disk is full; other errors pass."""
    try:
        yield
    except (RuntimeError, OSError) as error:
        reason = " ".join(str(error).split())
        if folder is None:
            raise
        if any(text in reason for text in _FULL):
            raise WorkspaceFault(
                f"{folder}: the disk is full ({reason[:160]}); free some space and try again; nothing is lost"
            ) from error
        if "lock" in reason.lower() and "LOCK" in reason:
            raise WorkspaceFault(f"{folder}: the graph cannot be opened, as it is open already ({reason})") from error
        if "Corruption" in reason or "IO error" in reason:
            raise WorkspaceFault(damaged(folder, reason)) from error
        raise


def telling(method: Method) -> Method:
    """Let a method of a graph, whose `folder` is that of its store, tell damage as `told` does."""

    @wraps(method)
    def wrapped(graph: Any, /, *given: Any, **named: Any) -> Any:
        with told(graph.folder):
            return method(graph, *given, **named)

    return cast(Method, wrapped)


def check_files(folder: Path) -> None:
    """Raise WorkspaceFault where files of a store are missing or altered. Without the first one it would begin anew."""
    if not (folder / "CURRENT").is_file() and next(folder.glob("[0-9M]*"), None) is not None:
        raise WorkspaceFault(damaged(folder, "its file CURRENT is missing"))
    fault = store_files.fault(folder)
    if fault is not None:
        raise WorkspaceFault(damaged(folder, fault))


def damaged(folder: Path, reason: str) -> str:
    """Return the line that says so, of the graph in a folder."""
    return (
        f"{folder}: the graph is damaged ({reason[:160]}); what the database holds is not lost: "
        f"`irtwin workspace repair --workspace {folder.parent}` rebuilds the graph from it"
    )
