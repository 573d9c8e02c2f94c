"""Samples on disk as they come, before they are a series: after a crash, all that was written is there.

A file of one live run: a line of JSON that says which, then rows of float64. What a process wrote survives its end; a
power failure may take what the operating system held back, some 30 s.
"""

from __future__ import annotations

import fcntl
import json
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np

from irtwin.document.form import from_json
from irtwin.errors import InputError
from irtwin.json_text import parse_json
from irtwin.storage.files import InsidePath, inside, is_locked
from irtwin.storage.schema import LIVE_RUN, WATCHED_RUNS

_ENDING = ".journal"


@dataclass(frozen=True)
class Header:
    """What a journal is of; `columns` of its rows, the first of which is `time`."""

    run_id: str
    robot_id: str
    payload_kg: float
    columns: tuple[str, ...]
    payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m, in the flange's frame
    performs: str | None = None  # run_id of the plan that it carries out
    kind: str = LIVE_RUN  # or REPLAYED_RUN


class DamagedJournal(ValueError):
    """A journal whose header cannot be read, though samples may follow it."""


class Journal:
    """A journal that is being written; locked, so that nobody takes it for one that a crash left."""

    def __init__(self, folder: Path, header: Header) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.path = inside(folder, f"{header.run_id}{_ENDING}")
        self._file = os.open(self.path, os.O_CREAT | os.O_EXCL | os.O_WRONLY | os.O_APPEND, 0o644)
        fcntl.flock(self._file, fcntl.LOCK_EX)
        self._write(json.dumps(asdict(header)).encode() + b"\n")

    def append(self, rows: np.ndarray) -> None:
        """Write rows, (N, columns): they outlive this process when this returns. OSError where the disk is full."""
        self._write(rows.tobytes())

    def close(self) -> None:
        """Let go of the file, which stays."""
        os.close(self._file)

    def _write(self, data: bytes) -> None:
        view = memoryview(data)
        while view:
            view = view[os.write(self._file, view) :]


def read_journal(path: Path) -> tuple[Header, np.ndarray]:
    """Read a journal; of a batch that a crash cut off, the whole rows before the cut. ValueError if it is none."""
    content = path.read_bytes()
    line, separator, data = content.partition(b"\n")
    if not separator:
        raise ValueError(f"{path}: ends within its header")
    try:
        header = _header(line)
    except (ValueError, InputError):
        raise DamagedJournal(f"{path}: its header is damaged") from None
    if path.name != f"{header.run_id}{_ENDING}":
        raise DamagedJournal(f"{path}: its header is that of run {header.run_id!r}")
    width = len(header.columns)
    rows = np.frombuffer(data[: len(data) // (8 * width) * 8 * width]).reshape(-1, width)
    rising = np.diff(rows[:, 0]) > 0  # a power failure may leave zeros at the end
    return header, rows[: len(rows) if rising.all() else int(np.argmin(rising)) + 1]


def _header(line: bytes) -> Header:
    header = from_json(Header, parse_json(line), "header")
    is_sound = header.kind in WATCHED_RUNS and header.columns[:1] == ("time",)
    if not is_sound or not header.run_id.startswith(f"{header.robot_id}."):
        raise ValueError
    return header


def of_robot(folder: Path, robot_id: str) -> list[InsidePath]:
    """Return the journals of a robot's live runs."""
    return [path for path in _all(folder) if path.name.startswith(f"{robot_id}.")]


def left_behind(folder: Path) -> Iterator[InsidePath]:
    """Yield the journals that nobody writes: those of processes that crashed."""
    yield from (path for path in _all(folder) if not is_locked(path))


def _all(folder: Path) -> list[InsidePath]:
    return [inside(folder, path.name) for path in sorted(folder.glob(f"*{_ENDING}"))]
