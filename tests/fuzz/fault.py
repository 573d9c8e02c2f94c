"""What counts as a fault in how a command ended."""

from __future__ import annotations

import json
import re
import signal
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import pyarrow.parquet
from tests.fuzz.child import SECONDS, Done

SET_ASIDE = 3  # exit status of a fleet that has refused a data set
LONGEST_LINE = 2000  # characters of an error
_FAILED = re.compile(r"^failed +\d|\b[1-9]\d* failed\b", re.M)
_STEP = re.compile(  # what a command says while it works, and of the log and the workspace
    r"^\s*\d+\.\d s  |^\s*\d+ s  step |^  |^\w[\w ]* \((cure first|doubtful|mended)\): "
    r"|^Rebuilding the graph from the database$|^Reasoning$|^Checking the constraints$"
    r"|: left aside, as nobody trusts it: |: not told: |; its samples are not in the graph; the file is kept as "
)
_FOUND = re.compile(r"^\w[\w ]* \(cure first\): |^damage +(?!none$)", re.M)  # all that is said where it is refused
_WARNING = re.compile(r"^.*\b\w*Warning: .*$", re.M)


@dataclass(frozen=True)
class Fault:
    """A command that failed as none may; `kind` is the same for the same fault."""

    command: str
    kind: str
    said: str


def fault_of(done: Done, writes: Sequence[Path], *, checks: bool = False, tells: bool = False) -> str | None:
    """Say what is wrong with how a command ended; None where nothing is.

    One that `checks` may say findings alone; one that `tells` of several things may need as many lines.
    """
    if done.status == -signal.SIGKILL:
        return f"hang of {SECONDS} s"
    if "Traceback (most recent call last)" in done.err:
        return _where(done.err)
    if done.status not in (0, 2, 3):
        return f"exit status {done.status}"
    if found := _WARNING.search(done.err):
        return re.sub(r"^.*/(src|site-packages)/", "", found[0])[:200]
    if tells and _FAILED.search(done.out + done.err):
        return "a data set failed that was neither done nor refused"
    if done.status and not (tells and (done.status == SET_ASIDE or "Written: " in done.err)):
        lines = [line for line in done.err.splitlines() if line.strip() and not _STEP.search(line)]
        if len(lines) != 1 and not (checks and not lines and _FOUND.search(done.err + done.out)):
            return f"{len(lines)} lines of error"
        if max(map(len, lines), default=0) > LONGEST_LINE:
            return "an error of many characters"
        return next((f"{file.name} written beside an error" for file in writes if file.exists()), None)
    return next((f"{file.name} is not whole" for file in writes if not _whole(file)), None)


def _where(err: str) -> str:
    """Return the last line of irtwin's in a traceback, and the error's kind: what tells two faults apart."""
    places = re.findall(r'File "[^"]*/src/(irtwin/[^"]*)", line (\d+), in (\S+)', err)
    ends = re.findall(r"^(\w[\w.]*(?:Error|Exception|Interrupt|Exit|Warning)\w*|[a-z_]+\.\w+)\b", err, re.M)
    place = f"{places[-1][0]} in {places[-1][2]}" if places else "?"
    return f"{ends[-1] if ends else 'error'} at {place}"


def _whole(file: Path) -> bool:
    if not file.exists():
        return False
    if file.suffix == ".json":
        json.loads(file.read_text(), parse_constant=_no_constant)
    if file.suffix == ".parquet":
        pyarrow.parquet.read_table(file)
    return file.stat().st_size > 0


def _no_constant(text: str) -> None:
    raise AssertionError(f"{text} is no JSON")
