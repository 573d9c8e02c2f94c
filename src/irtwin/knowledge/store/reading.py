"""Answers to queries of a graph since it was last written to.

A store in memory, and one that is open to write, changes by its graph alone, which then begins anew; a view of a folder
never changes. So what is kept here is true for as long as it is there.
"""

from __future__ import annotations

import re
from collections.abc import Hashable
from threading import Lock
from typing import Any

from irtwin.knowledge.store.union_store import UnionStore

MOST_ANSWERS = 256
# What answers anew each time, and the functions that read files; a backslash may hide them.
_NOT_KEPT = re.compile(r"\\|series|\b(?:now|rand|uuid|struuid|bnode)\b", re.IGNORECASE)


class KeptAnswers:
    """Answers by what was asked, the texts first; of too many the one goes that was asked for longest ago."""

    def __init__(self, most: int = MOST_ANSWERS) -> None:
        self._most = most
        self._answers: dict[Hashable, Any] = {}
        self._lock = Lock()

    def get(self, text: str, *beside: Hashable) -> Any:
        """Return the answer to a query, asked in some way; None where none is kept."""
        with self._lock:
            kept = self._answers.pop((text, *beside), None)
            if kept is not None:
                self._answers[(text, *beside)] = kept
            return kept

    def can_keep(self, text: str) -> bool:
        """Whether a query's text alone says what is answered."""
        return bool(self._most) and not _NOT_KEPT.search(text)

    def keep(self, answer: Any, text: str, *beside: Hashable) -> None:
        """Keep an answer, if it can be."""
        if not self.can_keep(text):
            return
        with self._lock:
            self._answers[(text, *beside)] = answer
            if len(self._answers) > self._most:
                del self._answers[next(iter(self._answers))]


def answers_of(store: UnionStore) -> KeptAnswers:
    """Return where answers of a store are kept that nobody else writes to: others write to a server."""
    return KeptAnswers(0 if store.embedded is None else MOST_ANSWERS)
