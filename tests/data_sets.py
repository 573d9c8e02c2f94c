"""Data sets on disk, and the command line called without a new process."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass
from io import StringIO
from pathlib import Path
from unittest import mock

import pyarrow as pa
import pyarrow.parquet

from irtwin.cli import main
from irtwin.robot.description import Robot
from irtwin.signals.log import Run


@dataclass(frozen=True)
class Said:
    """What a command printed and its exit status."""

    status: int
    out: str
    err: str


def irtwin(*arguments: object) -> Said:
    """Call the command line."""
    out, err, status = StringIO(), StringIO(), 0
    argv = ["irtwin", *map(str, arguments)]
    with mock.patch.object(sys, "argv", argv), redirect_stdout(out), redirect_stderr(err):
        try:
            main()
        except SystemExit as stop:
            status = int(stop.code or 0)
    return Said(status, out.getvalue(), err.getvalue())


def irtwin_does(*arguments: object) -> Said:
    """Call the command line, which is to do what it is asked."""
    said = irtwin(*arguments)
    assert said.status == 0, said.err
    return said


def done(*arguments: object) -> str:
    """Call the command line, which does as told; return what it printed."""
    return irtwin_does(*arguments).out


def irtwin_refuses(*arguments: object) -> Said:
    """Call the command line, which is to refuse."""
    said = irtwin(*arguments)
    assert said.status == 2, said.out
    return said


def refused(*arguments: object) -> str:
    """Call the command line, which refuses and prints nothing else; return what it says of the mistake."""
    said = irtwin_refuses(*arguments)
    assert (said.out, "Traceback" in said.err) == ("", False), said
    return said.err


def refused_in_a_line(*arguments: object) -> str:
    """Call the command line, which refuses, and return the one line that it says."""
    (line,) = refused(*arguments).splitlines()
    return line


def write(folder: Path, robot: Robot, runs: Iterable[Run], head: str = "", tail: str = "") -> Path:
    """Write runs as a data set; `head` goes into [robot], `tail` to the end of dataset.toml."""
    (folder / "runs").mkdir(parents=True)
    (folder / "robot.urdf").write_text(robot.urdf, encoding="utf-8")
    lines = ["[robot]", f'name = "{robot.name}"', 'urdf = "robot.urdf"', head]
    for run in runs:
        pa.parquet.write_table(table(robot, run), folder / "runs" / f"{run.name}.parquet")
        lines += ["[[run]]", f'file = "runs/{run.name}.parquet"', f'role = "{run.role}"']
        lines += [f"payload_mass = {run.payload_mass}", f"payload_com = {list(run.payload_com)}"]
        if run.repeat_of:
            lines.append(f'repeat_of = "runs/{run.repeat_of}.parquet"')
    (folder / "dataset.toml").write_text("\n".join([*lines, tail, ""]), encoding="utf-8")
    return folder


def table(robot: Robot, run: Run) -> pa.Table:
    """Return a run's signals in the log format's columns."""
    signals = run.signals
    columns = {"time": signals.time}
    for prefix, values in (("q", signals.q), ("tau", signals.torque), ("i", signals.current)):
        if values is not None:
            columns |= {f"{prefix}_{name}": values[:, k] for k, name in enumerate(robot.joint_names)}
    if signals.power is not None:
        columns["power"] = signals.power
    return pa.table(columns)
