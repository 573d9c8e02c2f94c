"""A graph as it stood on disk, read while another process may write.

Oxigraph opens a store read-only without taking its lock, and then sees what was committed when it was opened. Of its
files it opens sixteen at once and the others when a query comes to them; by then the writer may have removed them. So
each view has links of its own to all of them. While these are made, the writer may flush its log into a new file: what
was in the log would be missing. The manifest names the files that belong together, so where it and the logs are the
same before and after, the view is whole.

A writer that goes through many transactions before the graph is whole again keeps a view for readers: see `kept`.
"""

from __future__ import annotations

import os
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Self, TypeVar

from irtwin.errors import InputError, WorkspaceFault
from irtwin.knowledge.store.damage import check_files, damaged
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage import files

OLDEST = 0.5  # s; a view is not older than this when it answers
_PATIENCE = 5.0  # s after which files that nobody changed, and that cannot be read, are damaged
_MOST_PATIENCE = 20.0  # s that a writer may go on changing the files while they are opened
_NO_DATA = ("LOG", "LOCK")
_WRITTEN_ON = ("MANIFEST-*", "*.log")  # the others are complete when they get their names
_PREFIX = ".view-"  # of a folder of links beside the graph's
_PUBLISHED = f"{_PREFIX}of-all-"

Stamp = tuple[tuple[str, int, int], ...]
T = TypeVar("T")


@contextmanager
def view(folder: Path) -> Iterator[Path | None]:
    """Give a folder that shows a graph as it is now, for who has it open to write; None where no links can be made."""
    held, copy = _whole(lambda: folder, lambda source, held: _links(source, held, _WRITTEN_ON))
    with held:
        yield copy


@contextmanager
def kept(folder: Path) -> Iterator[None]:
    """Let readers see a graph as it is now until this ends, however it ends; for who has it open to write.

    Where no links can be made they see each transaction.
    """
    with view(folder) as copy:
        if copy is None:
            yield
            return
        name = copy.with_name(copy.name.replace(_PREFIX, _PUBLISHED, 1))
        copy.rename(name)
        try:
            yield
        finally:
            name.rename(copy)


def remove_left_behind(folder: Path) -> None:
    """Remove the links that killed processes left beside a graph's folder."""
    files.remove_left_behind(folder.parent, _PREFIX)


class Snapshot:
    """The newest view of a graph's folder, to be used as a context; opening it anew costs some 10 ms.

    A folder is read in place where no links can be made beside it. Raises InputError where there is no graph.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self._view = ExitStack()
        remove_left_behind(folder)
        check_files(folder)
        self._open()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._view.close()

    def current(self, at_once: bool = False) -> KnowledgeGraph:
        """Return a view that is at most `OLDEST` seconds behind what is committed; with `at_once`, not at all.

        It replaces the one before, which is closed.
        """
        if (at_once or time.monotonic() - self._checked > OLDEST) and self._state() != self._seen:
            self._open()
        return self.graph

    def _source(self) -> Path:
        """Return the folder that is to be seen: one that a writer keeps for readers, else the graph's own."""
        published = self._folder.parent.glob(f"{_PUBLISHED}*")
        return next(filter(files.is_locked, published), self._folder)  # else its process was killed

    def _state(self) -> tuple[Path, Stamp]:
        return (source := self._source()), _stamp(source)

    def _open(self) -> None:
        def opened(source: Path, view: ExitStack) -> KnowledgeGraph:
            self._checked, self._seen = time.monotonic(), self._state()
            files = _links(source, view) or source
            return view.enter_context(KnowledgeGraph(files, self._folder.parent, read_only=True))

        view, graph = _whole(self._source, opened)
        self._view.close()
        self._view, self.graph = view, graph
        graph.seen = repr(self._seen)


def _links(source: Path, held: ExitStack, copied: tuple[str, ...] = ()) -> Path | None:
    """Return a folder of links to a store's files; None where none can be made.

    What is linked stays when its owner removes it, as in RocksDB's checkpoints. Files whose names match one of the
    patterns `copied` are copied, as they will be written on.
    """
    try:
        with ExitStack() as made:
            view = made.enter_context(files.folder_in_use(source.parent, _PREFIX))
            for file in source.iterdir():
                if file.name.startswith(_NO_DATA):
                    continue
                if any(map(file.match, copied)):
                    shutil.copyfile(file, view / file.name)
                else:
                    os.link(file, view / file.name)
            held.enter_context(made.pop_all())
        return view
    except FileNotFoundError:  # a file went meanwhile
        raise
    except (OSError, WorkspaceFault):  # read-only, full, another user's, or without links
        return None


def _whole(source: Callable[[], Path], do: Callable[[Path, ExitStack], T]) -> tuple[ExitStack, T]:
    """Do something with the files of a store, again until they belonged together all the while.

    Return what is to be closed in the end, and what was made.
    """
    begun = since = time.monotonic()
    failed = None
    while time.monotonic() - begun < _MOST_PATIENCE:
        folder = source()
        belonging = _belonging(folder)
        if not belonging and folder == source():
            raise InputError(f"{folder}: no graph here; run `irtwin run DATASET` into this workspace first")
        with ExitStack() as view:
            try:
                made = do(folder, view)
            except (OSError, RuntimeError) as error:
                if failed != (folder, belonging):  # a file may have gone meanwhile
                    failed, since = (folder, belonging), time.monotonic()
                elif time.monotonic() - since > _PATIENCE:
                    raise InputError(damaged(folder, str(error))) from error
            else:
                if _belonging(folder) == belonging and folder == source():
                    return view.pop_all(), made
        time.sleep(0.01)
    raise InputError(f"{folder}: another process keeps changing the graph's files; try again")


def _belonging(folder: Path) -> Stamp:
    """Return what changes whenever files are added to a store, or removed from it."""
    manifests = _stamp(folder, "MANIFEST-*")
    return manifests and (*manifests, *((name, 0, 0) for name, _, _ in _stamp(folder, "*.log")))


def _stamp(folder: Path, pattern: str = "*") -> Stamp:
    """Return name, size and time of change of the files that hold data."""
    stamps = []
    for file in sorted(folder.glob(pattern)):
        if file.name.startswith(_NO_DATA):
            continue
        try:
            status = file.stat()
        except FileNotFoundError:
            continue
        stamps.append((file.name, status.st_size, status.st_mtime_ns))
    return tuple(stamps)
