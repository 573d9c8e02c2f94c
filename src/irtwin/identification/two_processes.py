"""Long work shared between this process and a copy of it: Python's lock lets threads do little of it side by side."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import traceback
from collections.abc import Callable, Sequence
from multiprocessing.connection import Connection
from typing import TypeVar

Item = TypeVar("Item")
Made = TypeVar("Made")
Work = Callable[[Sequence[Item]], Sequence[Made]]

_copied = False


def in_copy() -> bool:
    """Return whether this process is such a copy: what it tells, the other tells too."""
    return _copied


def can_copy() -> bool:
    """Return whether a copy may be made, and would have a processor of its own.

    That needs Linux, where a copy takes neither time nor memory of its own. It has no threads, so what another thread
    of this process holds would be held in it for ever. Who is a worker of others already is to make no more.
    """
    if not sys.platform.startswith("linux") or multiprocessing.current_process().daemon:
        return False
    return threading.active_count() == 1 and len(os.sched_getaffinity(0)) > 1


def shared(work: Work[Item, Made], items: Sequence[Item]) -> list[Made]:
    """Return what `work` makes of the items, one of each and in their order: of the later half in a copy.

    What is made has to be one that can be pickled. Raises what the work raises, and ChildProcessError where the copy
    ended before its time.
    """
    context = multiprocessing.get_context("fork")
    middle = -(-len(items) // 2)
    receiving, sending = context.Pipe(duplex=False)
    other = context.Process(target=_send, args=(sending, work, items[middle:]), daemon=True)
    other.start()
    sending.close()
    try:
        made = list(work(items[:middle]))
        for _ in items[middle:]:
            one = receiving.recv()
            if isinstance(one, BaseException):
                raise one
            made.append(one)
    except EOFError as gone:
        other.join()
        raise ChildProcessError(f"the process with half of the work ended with {other.exitcode}") from gone
    finally:
        receiving.close()
        other.terminate()
        other.join()
    return made


def _send(to: Connection, work: Work[Item, Made], items: Sequence[Item]) -> None:
    global _copied
    _copied = True
    try:
        made = work(items)
    except Exception as error:  # raised there, where the work was asked for
        error.add_note(traceback.format_exc())
        to.send(error)
        return
    for one in made:  # one by one: together they would take their memory twice
        to.send(one)
