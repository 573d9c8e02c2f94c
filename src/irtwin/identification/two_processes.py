"""Long work shared between this process and a copy of it: Python's lock lets threads do little of it side by side."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, contextmanager
from multiprocessing.connection import Connection
from typing import Generic, TypeVar

from threadpoolctl import threadpool_limits

Item = TypeVar("Item")
Made = TypeVar("Made")

_A_WHILE = 1.0  # s

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


def shared(work: Callable[[Sequence[Item]], Sequence[Made]], items: Sequence[Item]) -> list[Made]:
    """Return what `work` makes of the items, in their order: of the later half in a copy.

    What is made has to be one that can be pickled. Raises what the work raises, and ChildProcessError where the copy
    ended before its time.
    """
    middle = -(-len(items) // 2)
    with closing(_Copy(lambda: work(items[middle:]))) as other:
        return [*work(items[:middle]), *other.made()]


class Begun(Generic[Made]):
    """Work in a copy that began at once, or that is done when its result is asked for.

    Asked, by a call, it raises as `shared` does.
    """

    def __init__(self, work: Callable[[], Made], other: _Copy[Made] | None):
        self._work, self._other = work, other

    def __call__(self, waiting: Callable[[], None] | None = None) -> Made:
        """Return the result; `waiting` is called now and then as long as the copy is at work."""
        if self._other is None:
            return self._work()
        with closing(self._other) as other:
            return other.made(waiting)[0]

    def drop(self) -> None:
        """End the work: nobody will ask."""
        if self._other is not None:
            self._other.close()


def begun(work: Callable[[], Made], *, worth: bool) -> Begun[Made]:
    """Return what gives the result of `work`: from a copy that begins now, if it is `worth` one and may be made."""
    return Begun(work, _Copy(lambda: [work()]) if worth and can_copy() else None)


class _Copy(Generic[Made]):
    """A copy of this process at work."""

    def __init__(self, work: Callable[[], Sequence[Made]]):
        context = multiprocessing.get_context("fork")
        self._from, to = context.Pipe(duplex=False)
        self._process = context.Process(target=_send, args=(to, work), daemon=True)
        self._process.start()
        to.close()

    def made(self, waiting: Callable[[], None] | None = None) -> list[Made]:
        """Wait for what the work makes; `waiting` is called meanwhile."""
        try:
            while waiting is not None and not self._from.poll(_A_WHILE):
                waiting()
            count = self._from.recv()
            if isinstance(count, BaseException):
                raise count
            return [self._from.recv() for _ in range(count)]
        except EOFError as gone:
            self._process.join()
            raise ChildProcessError(
                f"the process with a part of the work ended with {self._process.exitcode}"
            ) from gone

    def close(self) -> None:
        """End the copy, whatever it does."""
        self._from.close()
        self._process.kill()  # it may have taken over what this process does when it is told to end
        self._process.join()


def _send(to: Connection, work: Callable[[], Sequence[Made]]) -> None:
    global _copied
    _copied = True
    try:
        made = work()
    except Exception as error:  # raised there, where the work was asked for
        error.add_note(traceback.format_exc())
        to.send(error)
        return
    to.send(len(made))
    for result in made:  # one by one: together they would take their memory twice
        to.send(result)


@contextmanager
def one_blas_thread() -> Iterator[None]:
    """Keep BLAS to one thread: runs are worked on side by side already, and two kinds of threads starve each other."""
    with threadpool_limits(limits=1, user_api="blas"):
        yield
