"""A child process with little time and memory, a home of its own, and what became of it."""

from __future__ import annotations

import os
import resource
import select
import signal
import sys
import tempfile
import traceback
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

SECONDS = 60  # of the processor, as others may share it
_PATIENCE = 300  # s, for what waits and does nothing
MEGABYTES = 2000  # beside what the libraries take


@dataclass(frozen=True)
class Done:
    """What became of a command: its status (negative: the signal) and what it printed."""

    status: int
    out: str
    err: str


def in_child(work: Callable[[], None], folder: Path, stdin: Path | None = None, patience: float | None = None) -> Done:
    """Do some work in a child process with little time and memory; Ctrl-C comes after `patience` s.

    The folder is its home too: what is trusted is written there. What it has started ends with it.
    """
    with tempfile.TemporaryFile() as out, tempfile.TemporaryFile() as err:  # where no spoilt link leads
        child = os.fork()
        if child == 0:
            os.setpgid(0, 0)
            _child(work, folder, stdin or Path(os.devnull), out.fileno(), err.fileno())
        status = _ended(child, patience)
        said = (os.pread(file.fileno(), 1 << 30, 0).decode(errors="replace") for file in (out, err))
        return Done(os.waitstatus_to_exitcode(status), *said)


def _ended(child: int, patience: float | None) -> int:
    """Return the status with which a child ended, or was made to end."""
    end = os.pidfd_open(child)
    try:
        if patience is not None and not select.select([end], [], [], patience)[0]:
            os.kill(child, signal.SIGINT)
        if not select.select([end], [], [], _PATIENCE)[0]:
            os.kill(child, signal.SIGKILL)
        return os.waitpid(child, 0)[1]
    finally:
        os.close(end)
        with suppress(ProcessLookupError, PermissionError):
            os.killpg(child, signal.SIGKILL)


def _child(work: Callable[[], None], home: Path, stdin: Path, out: int, err: int) -> None:
    status = 1
    try:
        signal.signal(signal.SIGINT, signal.default_int_handler)  # which a session in the background has not
        os.environ |= {"HOME": str(home), "XDG_CONFIG_HOME": str(home / "config")}
        for number, file in ((0, os.open(stdin, os.O_RDONLY)), (1, out), (2, err)):
            os.dup2(file, number)
        sys.stdin, sys.stdout, sys.stderr = open(0), open(1, "w"), open(2, "w")  # noqa: SIM115
        warnings.resetwarnings()
        for kind in (DeprecationWarning, PendingDeprecationWarning, ImportWarning, ResourceWarning):
            warnings.simplefilter("ignore", kind)
        warnings.showwarning = lambda said, kind, file, line, *_: print(
            f"{file}:{line}: {kind.__name__}: {said}", file=sys.stderr
        )
        pages = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
        resource.setrlimit(resource.RLIMIT_DATA, (pages + (MEGABYTES << 20),) * 2)
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS))
        work()
        status = 0
    except SystemExit as stop:
        status = stop.code if isinstance(stop.code, int) else 0 if stop.code is None else 1
    except BaseException:
        traceback.print_exc()
    finally:
        for stream in (sys.stdout, sys.stderr):
            stream.flush()
        os._exit(status)
