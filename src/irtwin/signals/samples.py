"""The samples of one run: read from its source, and checked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, REQUIRED, Channel, Signals, by_column, from_columns
from irtwin.signals.sources.catalogue import source_of
from irtwin.signals.sources.source import Source, check_names

UNSIGNED = "abs_"  # of a column of torque without its sign, tau_abs_JOINT: no torque
FEWEST = 20  # samples; fewer cannot be filtered


def read_signals(
    path: Path,
    robot: Robot,
    *,
    repair: bool = False,
    measured: bool = True,
    commanded: bool = False,
    topics: Mapping[str, str] | None = None,
) -> tuple[Signals, list[str]]:
    """Read a run's file; return its signals and a line for each kind of sample that was dropped.

    `repair` drops bad samples; `measured`: whether torque or power has to be there, or the motion is enough;
    `commanded`: whether commands do in their place; `topics`: what [topics] of dataset.toml says. Raises InputError,
    naming file, line or row and column, on anything `LOG_FORMAT.md` calls bad input.
    """
    source = source_of(path, robot, topics)
    channels = by_column(robot.joint_names)
    known = _known(source.columns(), channels, robot, path)
    table, repairs = source.read(known, repair=repair)
    columns = {name.strip(): _floats(table.column(name)) for name in known}
    keep, dropped = _bad_samples(columns, channels, source, repair)
    if not keep.all():
        columns = {name: values[keep] for name, values in columns.items()}
    if len(columns["time"]) < FEWEST:
        raise InputError(f"{path}: has {len(columns['time'])} samples; a run needs at least {FEWEST}")
    signals = _signals(columns, robot, path)
    played = commanded and signals.command is not None
    if measured and not played and signals.torque is None and signals.power is None:
        raise InputError(f"{path}: has neither torque nor power; {_remedy(signals, commanded)}")
    return signals, repairs + dropped + _unsigned(source.columns())


def _known(columns: Sequence[str], channels: Mapping[str, Channel], robot: Robot, path: Path) -> list[str]:
    """Return those columns that the log format knows; raise on missing, repeated, foreign ones."""
    names = [name.strip() for name in columns]
    check_names(path, names)
    strict = {channel.prefix for channel in CHANNELS.values() if channel.strict}
    for name in names:
        prefix, _, joint = name.partition("_")
        unsigned = prefix == CHANNELS["torque"].prefix and joint.startswith(UNSIGNED)
        if prefix in strict and joint and name not in channels and joint not in robot.held and not unsigned:
            raise InputError(
                f'{path}: column {name}: the robot has no moving joint "{joint}" '
                f"(it has {', '.join(robot.joint_names)})"
            )
    for needed in (name for field in REQUIRED for name in CHANNELS[field].columns(robot.joint_names)):
        if needed not in names:
            metered = not any(name.endswith(tuple(robot.joint_names)) for name in names)
            cure = "; a log of power alone is a meter's: say joints = [] and no urdf in dataset.toml" if metered else ""
            raise InputError(f"{path}: column {needed} is missing{cure}")
    return [column for column, name in zip(columns, names, strict=True) if name in channels]


def _floats(column: pa.ChunkedArray) -> np.ndarray:
    kind = column.type
    if pa.types.is_string(kind) or pa.types.is_large_string(kind):
        return np.array([_float(value) for value in column.to_pylist()])
    if not (pa.types.is_floating(kind) or pa.types.is_integer(kind) or pa.types.is_decimal(kind)):
        return np.full(len(column), np.nan)
    return np.array(column.cast(pa.float64(), safe=False).to_numpy(zero_copy_only=False))


def _float(text: str | None) -> float:
    try:
        return float(text) if text is not None else np.nan
    except ValueError:
        return np.nan


def _bad_samples(
    columns: Mapping[str, np.ndarray], channels: Mapping[str, Channel], source: Source, repair: bool
) -> tuple[np.ndarray, list[str]]:
    """Return which samples to keep and, with `repair`, what was dropped; raise at the first bad one without it."""
    keep = np.ones(len(columns["time"]), dtype=bool)
    dropped: list[str] = []

    def drop(bad: np.ndarray, column: str, fault: str) -> None:
        if not bad.any():
            return
        rows = np.flatnonzero(bad)
        if not repair:
            raise InputError(
                f"{source.path}, {source.place(rows[0])}, column {column}: {fault}; correct it, or use --repair to "
                "drop such samples"
            )
        shown = ", ".join(source.place(row) for row in rows[:10]) + (" ..." if len(rows) > 10 else "")
        dropped.append(f"{source.path}: {len(rows)} samples dropped, column {column} {fault}: {shown}")
        keep[rows] = False

    for name, values in columns.items():
        greatest = channels[name].greatest
        drop(keep & ~np.isfinite(values), name, "is not a finite number")
        with np.errstate(invalid="ignore"):
            drop(keep & (np.abs(values) > greatest), name, f"is beyond {greatest:g}, which no robot reaches")
    kept = np.flatnonzero(keep)
    time = columns["time"][kept]
    latest = np.maximum.accumulate(time)
    falls = np.zeros(len(keep), dtype=bool)
    falls[kept[1:]] = time[1:] <= latest[:-1]
    drop(falls, "time", "does not rise")
    return keep, dropped


def _signals(columns: Mapping[str, np.ndarray], robot: Robot, path: Path) -> Signals:
    """Return the columns as signals; torque of the currents, and power of what the meter says, where these are not."""
    for channel in CHANNELS.values():
        own = channel.columns(robot.joint_names)
        absent = [name for name in own if name not in columns]
        if 0 < len(absent) < len(own):
            raise InputError(
                f"{path}: column {absent[0]} is missing; log {channel.prefix}_ for every moving joint or for none"
            )
    signals = from_columns(columns, robot.joint_names)
    torque, power = signals.torque, signals.power
    if torque is None and signals.current is not None:
        constants = [joint.torque_constant for joint in robot.joints]
        if all(constant is not None for constant in constants):
            torque = signals.current * np.array(constants, dtype=float)
    if power is None and signals.meter_voltage is not None and signals.meter_current is not None:
        power = signals.meter_voltage * signals.meter_current
    return replace(signals, torque=torque, power=power)


def _unsigned(columns: Sequence[str]) -> list[str]:
    """Return a line where a log has torque without its sign."""
    prefix = f"{CHANNELS['torque'].prefix}_{UNSIGNED}"
    if not any(name.strip().startswith(prefix) for name in columns):
        return []
    return [f"{prefix}JOINT is torque without its sign, as of a current's size, and no torque: left out"]


def _remedy(signals: Signals, commanded: bool) -> str:
    if signals.command is not None:
        return "its commands can be held against a model: irtwin diagnose DATASET --simulator MODEL.xml"
    if signals.current is not None:
        return "give torque_constant for each joint in dataset.toml, or log tau_ or power"
    return "log tau_, i_ or power" + (", or cmd_, the commands that the model is to play" if commanded else "")
