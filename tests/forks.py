"""Processes that begin with what they need imported: forked from one that has opened no store.

A fork of this process would lack the threads of its stores. One such process serves all tests of a process.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from multiprocessing.connection import Connection
from pathlib import Path
from subprocess import TimeoutExpired
from typing import TextIO, cast

from irtwin.cli import main
from tests import killed_writers

FORKS = multiprocessing.get_context("forkserver")
FORKS.set_forkserver_preload([killed_writers.__name__, "irtwin.serve.server", "irtwin.workflow"])


class Command:
    """The command line in a process of its own, with pipes, to be spoken to as to a `subprocess.Popen` of text.

    prepare: called in the process before the command begins; a function of a module.
    """

    def __init__(
        self, *arguments: object, folder: Path | None = None, prepare: Callable[[], None] | None = None, **more: str
    ):
        (reads, writes), (out, prints), (err, warns) = (FORKS.Pipe(duplex=False) for _ in range(3))
        self.stdin, self.stdout, self.stderr = _opened(writes, "w"), _opened(out, "r"), _opened(err, "r")
        ends, argv = (reads, prints, warns), ["irtwin", *map(str, arguments)]
        environment = {**os.environ, **more}
        self._process = FORKS.Process(target=_begin, args=(argv, ends, folder or Path.cwd(), environment, prepare))
        self._process.start()
        self.killed = False  # by `kill`
        for end in ends:
            end.close()

    @property
    def pid(self) -> int:
        """The process' id."""
        assert self._process.pid is not None
        return self._process.pid

    @property
    def returncode(self) -> int | None:
        """The exit status, or minus the signal that ended it."""
        return self._process.exitcode

    def poll(self) -> int | None:
        """Return the exit status of a process that has ended."""
        return self.returncode

    def send_signal(self, number: int) -> None:
        """Send a signal to a process that has not ended."""
        if self.returncode is None:
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End the process at once."""
        self.killed = True
        self.send_signal(signal.SIGKILL)

    def wait(self, timeout: float | None = None) -> int:
        """Return the exit status once the process has ended; TimeoutExpired after a time in s."""
        self._process.join(timeout)
        if self.returncode is None:
            raise TimeoutExpired("irtwin", timeout or 0.0)
        return self.returncode

    def communicate(self, text: str = "", timeout: float = 120.0) -> tuple[str, str]:
        """Say the last, and return the rest of output and errors once the process has ended."""
        with ThreadPoolExecutor(2) as readers:
            out, err = (readers.submit(pipe.read) for pipe in (self.stdout, self.stderr))
            if not self.stdin.closed:
                self.stdin.write(text)
                self.stdin.close()
            said = out.result(timeout), err.result(timeout)
        self.wait(timeout)
        return said


def _opened(end: Connection, mode: str) -> TextIO:
    file = os.fdopen(os.dup(end.fileno()), mode, encoding="utf-8")
    end.close()
    return cast(TextIO, file)


def _begin(
    argv: list[str],
    ends: tuple[Connection, ...],
    folder: Path,
    environment: dict[str, str],
    prepare: Callable[[], None] | None,
) -> None:
    for number, end in enumerate(ends):
        os.dup2(end.fileno(), number)
        end.close()
    sys.stdin, sys.stdout, sys.stderr = os.fdopen(0), os.fdopen(1, "w"), os.fdopen(2, "w", 1)
    signal.signal(signal.SIGINT, signal.default_int_handler)  # shells ignore it in what runs behind
    os.chdir(folder)
    os.environ.clear()
    os.environ.update(environment)
    sys.argv = argv
    if prepare:
        prepare()
    main()
