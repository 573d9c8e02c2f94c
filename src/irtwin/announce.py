"""How a job says what it does: line by line, to whoever asked for it."""

from __future__ import annotations

from collections.abc import Callable

Announce = Callable[[str], None]
