"""A graph as it stood on disk, read while another process may write.

Oxigraph opens a store read-only without taking its lock, and then sees what was committed when it was opened.
While files are opened, the writer may flush its log into a new file and delete the old ones: what was in the log
would be missing. The manifest names all files that belong together, so where it stayed the same the view is whole.
"""

from __future__ import annotations

import time
from pathlib import Path

from irtwin.errors import InputError
from irtwin.knowledge.graph import KnowledgeGraph

OLDEST = 0.5  # s; a view is not older than this when it answers
_PATIENCE = 5.0  # s that a writer may go on changing the files while they are opened

Stamp = tuple[tuple[str, int, int], ...]


class Snapshot:
    """The newest view of a graph's folder; opening it anew costs some 10 ms."""

    def __init__(self, folder: Path):
        self._folder = folder
        self._open()

    def renewed(self) -> KnowledgeGraph:
        """Return a view that was opened just now."""
        self._open()
        return self.graph

    def current(self, at_once: bool = False) -> KnowledgeGraph:
        """Return a view that is at most `OLDEST` seconds behind what is committed; with `at_once`, not at all."""
        if (at_once or time.monotonic() - self._checked > OLDEST) and _stamp(self._folder, "*") != self._seen:
            self._open()
        return self.graph

    def _open(self) -> None:
        give_up = time.monotonic() + _PATIENCE
        reason: Exception | str = "another process keeps changing its files"
        while time.monotonic() < give_up:
            self._checked = time.monotonic()
            self._seen = _stamp(self._folder, "*")
            manifest = _stamp(self._folder, "MANIFEST-*")
            if not manifest:
                raise InputError(f"{self._folder}: no graph here; run `irtwin run DATASET` into this workspace first")
            try:
                self.graph = KnowledgeGraph.as_it_stands(self._folder)
                if _stamp(self._folder, "MANIFEST-*") == manifest:
                    return
            except (OSError, RuntimeError) as error:  # a file went while it was opened
                reason = error
            time.sleep(0.01)
        raise InputError(f"{self._folder}: the graph cannot be read: {reason}")


def _stamp(folder: Path, pattern: str) -> Stamp:
    """Return name, size and time of change of the files that hold data."""
    found = []
    for file in sorted(folder.glob(pattern)):
        if file.name.startswith(("LOG", "LOCK")):
            continue
        try:
            status = file.stat()
        except FileNotFoundError:
            continue
        found.append((file.name, status.st_size, status.st_mtime_ns))
    return tuple(found)
