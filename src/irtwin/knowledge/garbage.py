"""Python's garbage collector, asked seldom while terms and triples are made by the ten thousand: they hold no cycles.

It looks through all of them again and again, which takes a fifth to a half of the time.
"""

from __future__ import annotations

import gc
from collections.abc import Iterator
from contextlib import contextmanager

_NEW_OBJECTS = 50_000  # until it looks through these; Python's own number is 700


@contextmanager
def seldom_collected() -> Iterator[None]:
    """Have garbage collected less often until the block, or the function that this decorates, ends."""
    before = gc.get_threshold()
    gc.set_threshold(max(_NEW_OBJECTS, before[0]) if before[0] else 0, *before[1:])  # 0 is never
    try:
        yield
    finally:
        gc.set_threshold(*before)
