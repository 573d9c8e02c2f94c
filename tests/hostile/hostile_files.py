"""Small files that ask their reader for much: a name each, whose end is the file's, and a function that writes it.

Each is below 10 MB, a little beyond what is allowed, and made in a moment.
"""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

Write = Callable[[Path], object]


class Files(dict[str, Write]):
    """Functions by the names of the files that they write."""

    def named(self, name: str) -> Callable[[Write], Write]:
        """Keep a function by a name."""
        return lambda write: self.setdefault(name, write)
