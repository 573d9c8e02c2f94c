"""A motion in a folder of two files, as NVIDIA's SAGE has it: commands and states, a list of all joints in a cell."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from irtwin.bring.recording import Recording
from irtwin.errors import InputError
from irtwin.input_file import as_text, read_input
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS

_COMMANDS, _STATES, _JOINTS = "control.csv", "state_motor.csv", "joint_list.txt"
_LARGEST = 1_000_000_000  # bytes
_FIELDS = {
    "positions": "q",
    "velocities": "dq",
    "torques": "torque",
    "currents": "current",
    "temperatures": "temperature",
}


def is_motion(path: Path) -> bool:
    """Return whether a path is the folder of such a motion. Raises InputError where it is one of its files alone."""
    if path.name in (_COMMANDS, _STATES) and (path.parent / _STATES).exists() and (path.parent / _COMMANDS).exists():
        raise InputError(f"{path}: is one of a motion's two files; give their folder, {path.parent}")
    return path.is_dir() and ((path / _STATES).exists() or (path / _COMMANDS).exists())


def read_motion(folder: Path, robot: Robot) -> Recording:
    """Read a motion: at the times of its states these, and the command that came last.

    Raises InputError where a file is missing, a cell is no list of one number a joint, or the robot's joints are not
    among those of the folder's joint_list.txt; without that file, lists are of the robot's joints, base to flange.
    """
    joints = _joints(folder, robot)
    time, states = _read(folder / _STATES, joints, _FIELDS)
    told_at, told = _read(folder / _COMMANDS, joints, ("positions",))
    if told_at[0] > time[-1] or time[0] > told_at[-1]:
        raise InputError(
            f"{folder}: commands are of the times {told_at[0]:.10g} to {told_at[-1]:.10g}, states of {time[0]:.10g} to "
            f"{time[-1]:.10g}; give both by one clock"
        )
    last = np.maximum(np.searchsorted(told_at, time, side="right") - 1, 0)
    lists = {_FIELDS[name]: values for name, values in states.items()} | {"command": told["positions"][last]}
    columns, units = {"time": time}, {}
    for field, values in lists.items():
        for joint in robot.joints:
            column = CHANNELS[field].column(joint.name)
            columns[column] = values[:, joints.index(joint.name)]
            units[column] = CHANNELS[field].unit_of(joint.kind)
    return Recording(folder, "control.csv and state_motor.csv", columns, units=units, counted="state")


def _joints(folder: Path, robot: Robot) -> Sequence[str]:
    path = folder / _JOINTS
    if not path.exists():
        return robot.joint_names
    listed = as_text(path, read_input(path, _LARGEST)).split()
    lacking = [name for name in robot.joint_names if name not in listed]
    if lacking:
        raise InputError(
            f"{path}: has no joint {', '.join(lacking)}; its joints are {', '.join(listed)[:400]}: give them the names "
            "of the robot's"
        )
    return listed


def _read(
    path: Path, joints: Sequence[str], names: Sequence[str] | Mapping[str, str]
) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Return the times (N,) of a file and its lists (N, number of joints) by name, without those that are blank."""
    rows = csv.DictReader(io.StringIO(as_text(path, read_input(path, _LARGEST))))
    header = rows.fieldnames or []
    for name in ("timestamp", "positions"):
        if name not in header:
            raise InputError(f"{path}, line 1: has no column {name}; its columns are {', '.join(header)[:400]}")
    times: list[float] = []
    columns: dict[str, list[list[float]]] = {name: [] for name in names if name in header}
    for row in rows:
        times += _numbers(path, rows.line_num, "timestamp", row["timestamp"], 1)
        for name, lists in columns.items():
            lists.append(_numbers(path, rows.line_num, name, row[name], len(joints)))
    if not times:
        raise InputError(f"{path}: has no sample; an empty run cannot be used")
    wrong = ~(np.diff(times, prepend=times[0]) >= 0)
    if wrong.any():
        raise InputError(f"{path}, sample {np.argmax(wrong) + 1}: time falls, or is blank; sort the file by timestamp")
    arrays = {name: np.array(lists) for name, lists in columns.items()}
    return np.array(times), {name: values for name, values in arrays.items() if not np.isnan(values).all()}


def _numbers(path: Path, line: int, name: str, cell: str | None, count: int) -> list[float]:
    """Return the numbers of a cell, as "[0.1, 0.2]"; NaN for each where it is blank."""
    try:
        numbers = [float(text) for text in (cell or "").strip(" []").replace(",", " ").split()]
    except ValueError:
        raise InputError(
            f"{path}, line {line}, column {name}: {str(cell)[:40]!r} is no list of numbers; correct it"
        ) from None
    if numbers and len(numbers) != count:
        raise InputError(
            f"{path}, line {line}, column {name}: {len(numbers)} values, not {count}, one a joint; correct it"
        )
    return numbers or [float("nan")] * count
