"""Lines that were refused: all are counted, and each reason is told once."""

from __future__ import annotations

import threading
from collections.abc import Callable

from irtwin.errors import InputError
from irtwin.live.stream_clock import WrongTime

_MOST_REASONS = 100  # told: some for each robot of a cell; further ones are counted alone


class RefusedLines:
    """Tells `announce`; threads may refuse at once. `count` of all."""

    def __init__(self, announce: Callable[[str], None]) -> None:
        self.count = 0
        self._announce = announce
        self._told: set[str] = set()
        self._lock = threading.Lock()

    def refuse(self, error: InputError) -> None:
        """Refuse a line by its error; one of a wrong time is told with the seconds of the first."""
        reason = error.reason if isinstance(error, WrongTime) else str(error)
        with self._lock:
            self.count += 1
            is_news = reason not in self._told and len(self._told) < _MOST_REASONS
            if is_news:
                self._told.add(reason)
        if is_news:
            self._announce(f"line refused: {error}")
