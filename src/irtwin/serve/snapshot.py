"""A graph as it stood on disk, read while another process may write.

Oxigraph opens a store read-only without taking its lock, and then sees what was committed when it was opened. Of its
files it opens sixteen at once and the others when a query comes to them; by then the writer may have removed them. So
each view has links of its own to all of them. While these are made, the writer may flush its log into a new file: what
was in the log would be missing. The manifest names the files that belong together, so where it and the logs are the
same before and after, the view is whole.
"""

from __future__ import annotations

import os
import time
from contextlib import ExitStack
from pathlib import Path
from typing import Self

from irtwin.errors import InputError
from irtwin.knowledge.damage import check_files, damaged
from irtwin.knowledge.graph import KnowledgeGraph
from irtwin.serve.linked import linked, remove_left_behind

OLDEST = 0.5  # s; a view is not older than this when it answers
_PATIENCE = 5.0  # s that a writer may go on changing the files while they are opened
_NO_DATA = ("LOG", "LOCK")

Stamp = tuple[tuple[str, int, int], ...]


class Snapshot:
    """The newest view of a graph's folder, to be used as a context; opening it anew costs some 10 ms.

    A folder that nothing can be written beside is read in place. Raises InputError where there is no graph.
    """

    def __init__(self, folder: Path):
        self._folder = folder
        self._view = ExitStack()
        check_files(folder)
        remove_left_behind(folder)
        self._open()

    def __enter__(self) -> Self:
        """Return the snapshot; leaving the block closes it."""
        return self

    def __exit__(self, *exception: object) -> None:
        self._view.close()

    def current(self, at_once: bool = False) -> KnowledgeGraph:
        """Return a view that is at most `OLDEST` seconds behind what is committed; with `at_once`, not at all.

        It replaces the one before, which is closed.
        """
        if (at_once or time.monotonic() - self._checked > OLDEST) and _stamp(self._folder) != self._seen:
            self._open()
        return self.graph

    def _open(self) -> None:
        give_up = time.monotonic() + _PATIENCE
        reason = "another process keeps changing its files"
        while time.monotonic() < give_up:
            self._checked = time.monotonic()
            self._seen = _stamp(self._folder)
            belonging = self._belonging()
            if not belonging:
                raise InputError(f"{self._folder}: no graph here; run `irtwin run DATASET` into this workspace first")
            with ExitStack() as view:
                try:
                    graph = self._opened(view)
                except (OSError, RuntimeError) as error:  # a file went while it was linked
                    reason = str(error)
                else:
                    if self._belonging() == belonging:
                        self._view.close()
                        self._view, self.graph = view.pop_all(), graph
                        return
            time.sleep(0.01)
        raise InputError(damaged(self._folder, reason))

    def _opened(self, view: ExitStack) -> KnowledgeGraph:
        workspace, files = self._folder.parent, self._folder
        if os.access(workspace, os.W_OK):
            files = view.enter_context(linked(self._folder, *_NO_DATA))
        return view.enter_context(KnowledgeGraph.as_it_stands(files, workspace))

    def _belonging(self) -> Stamp:
        """Return what changes whenever files are added to the store, or removed from it."""
        manifests = _stamp(self._folder, "MANIFEST-*")
        return manifests and (*manifests, *((name, 0, 0) for name, _, _ in _stamp(self._folder, "*.log")))


def _stamp(folder: Path, pattern: str = "*") -> Stamp:
    """Return name, size and time of change of the files that hold data."""
    found = []
    for file in sorted(folder.glob(pattern)):
        if file.name.startswith(_NO_DATA):
            continue
        try:
            status = file.stat()
        except FileNotFoundError:
            continue
        found.append((file.name, status.st_size, status.st_mtime_ns))
    return tuple(found)
