"""A folder of links to the files of another: they stay when their owner removes them, as in RocksDB's checkpoints."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from irtwin.storage import files

_PREFIX = ".view-"
_PUBLISHED = f"{_PREFIX}of-all-"


@contextmanager
def linked(folder: Path, ignored: tuple[str, ...], copied: tuple[str, ...] = ()) -> Iterator[Path]:
    """Give a folder beside another, with links to its files but those whose names start with one of `ignored`.

    Files whose names match one of the patterns `copied` are copied, as they will be written on. FileNotFoundError where
    a file goes meanwhile, OSError or WorkspaceFault where links cannot be made there.
    """
    with files.folder_in_use(folder.parent, _PREFIX) as view:
        for file in folder.iterdir():
            if file.name.startswith(ignored):
                continue
            if any(map(file.match, copied)):
                shutil.copyfile(file, view / file.name)
            else:
                os.link(file, view / file.name)
        yield view


@contextmanager
def published(view: Path) -> Iterator[None]:
    """Let others find a linked folder by `found` for as long as this lasts."""
    name = view.with_name(view.name.replace(_PREFIX, _PUBLISHED, 1))
    view.rename(name)
    try:
        yield
    finally:
        name.rename(view)


def found(folder: Path) -> Path | None:
    """Return the folder of links that a process that lives has published beside a folder."""
    return next((view for view in folder.parent.glob(f"{_PUBLISHED}*") if files.is_locked(view)), None)


def remove_left_behind(folder: Path) -> None:
    """Remove the links that killed processes left beside a folder."""
    files.remove_left_behind(folder.parent, _PREFIX)
