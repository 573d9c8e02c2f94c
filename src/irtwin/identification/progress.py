"""How far long work has come: lines for whoever listens."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass
from typing import TypeVar

from irtwin.identification.two_processes import in_copy

Item = TypeVar("Item")

_EVERY = 2.5  # s between two lines at least: with a step that long there is one each 5 s, and short work says none


@dataclass
class _Listener:
    """Who hears lines, and when the last was told: one clock for all that is done in turn."""

    hear: Callable[[str], None]
    last: float


_listener: ContextVar[_Listener | None] = ContextVar("listener", default=None)


@contextmanager
def telling(hear: Callable[[str], None] | None) -> Iterator[None]:
    """Let `hear` have the lines that the work inside tells; None: who hears them already, if anyone."""
    if hear is None:
        yield
        return
    token = _listener.set(_Listener(hear, time.monotonic()))
    try:
        yield
    finally:
        _listener.reset(token)


def tell(line: str) -> None:
    """Tell a line."""
    if (listener := _listener.get()) is not None:
        listener.last = time.monotonic()
        listener.hear(line)


def tell_step(line: str) -> None:
    """Tell a line where the last was some seconds ago: it may be called at each step."""
    listener = _listener.get()
    if listener is not None and time.monotonic() - listener.last >= _EVERY and not in_copy():
        tell(line)


def track(items: Iterable[Item], line: str | Callable[[Item], str]) -> Iterator[Item]:
    """Yield items; tell of each, as `tell_step` does, the line, which it is, and of how many."""
    every = list(items)
    for number, item in enumerate(every, start=1):
        tell_step(f"  {line if isinstance(line, str) else line(item)}, {number} of {len(every)}")
        yield item
