"""Runs readers on hostile input, each in a process of its own with little time and memory.

A server process imports the readers once and forks for each case: `python guard.py` takes one line of JSON for each
(room and arguments), and answers with one line: what became of it, what was said, seconds and megabytes.
"""

from __future__ import annotations

import json
import os
import resource
import signal
import sys
import time
from collections.abc import Callable
from pathlib import Path

from irtwin.errors import InputError
from irtwin.knowledge.engines import close_file
from irtwin.knowledge.mapping import map_to_file
from irtwin.knowledge.owl_rl.closure import Contradiction
from irtwin.robot.urdf import read_urdf

SECONDS = 20  # of processor time
SQL_SECONDS = 2
MEGABYTES = 700  # beside what the readers' libraries take

ROOMS: dict[str, Callable[..., object]] = {
    "mapping": lambda folder, database: map_to_file(
        Path(folder, "input.ttl"),
        database or f"sqlite:///{folder}/data.db",
        Path(folder, "out.nq"),
        seconds=SQL_SECONDS,
    ),
    "ontology": lambda folder, name: close_file(Path(folder, name), Path(folder, "out.nt")),
    "urdf": lambda folder, name: read_urdf(Path(folder, name)),
}


def _child(room: str, arguments: list[str], answer: int) -> None:
    pages = int(Path("/proc/self/statm").read_text().split()[5]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_DATA, (pages + (MEGABYTES << 20),) * 2)
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    try:
        ROOMS[room](*arguments)
        outcome, said = "accepted", ""
    except (InputError, Contradiction) as error:
        outcome, said = "refused", str(error)
    except BaseException as error:
        outcome, said = "bug", f"{type(error).__name__}: {error}"
    os.write(answer, json.dumps([outcome, said[:2000]]).encode())
    os._exit(0)


def _guarded(room: str, arguments: list[str]) -> dict[str, object]:
    mine, theirs = os.pipe()
    began = time.monotonic()
    child = os.fork()
    if child == 0:
        _child(room, arguments, theirs)
    os.close(theirs)
    with os.fdopen(mine, "rb") as answer:
        said = answer.read()
    _, status, usage = os.wait4(child, 0)
    if said:
        outcome, message = json.loads(said)
    else:
        outcome, message = "died", signal.Signals(os.WTERMSIG(status)).name if os.WIFSIGNALED(status) else "exit"
    return {
        "outcome": outcome,
        "message": message,
        "elapsed": time.monotonic() - began,
        "seconds": usage.ru_utime + usage.ru_stime,
        "megabytes": usage.ru_maxrss / 1024,
    }


if __name__ == "__main__":
    print("ready", flush=True)
    for line in sys.stdin:
        print(json.dumps(_guarded(**json.loads(line))), flush=True)
