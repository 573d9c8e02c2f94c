"""Long tables in pages; the tables as files stay whole."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TypeVar

PAGE = 50  # lines of a table on a page
T = TypeVar("T")


def pages(lines: Sequence[object]) -> int:
    """Return how many pages so many lines take, one at least."""
    return max(1, -(-len(lines) // PAGE))


def on_page(lines: Sequence[T], number: int) -> Sequence[T]:
    """Return the lines of a page, the first of which is 1; beyond the last, those of the last."""
    start = (min(number, pages(lines)) - 1) * PAGE
    return lines[start : start + PAGE]


def page_number(text: str | None) -> int:
    """Return the page that an address asks for; the first where it says none, or nonsense."""
    return max(1, int(text)) if text and text.isascii() and text.isdigit() and len(text) < 10 else 1
