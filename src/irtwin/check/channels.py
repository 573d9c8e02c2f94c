"""Each column by itself: does it change, evenly, over its range, and all the time?"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from irtwin.check.moving import Moving
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, columns_of
from irtwin.signals.finding import LogFinding
from irtwin.signals.motion import stretches
from irtwin.signals.sampling import interval

_JITTER = 0.3  # of the interval: median deviation of the times between samples
_HELD = 0.9  # of a column's changes come at one pace, of several samples
_FLAT = 0.02  # of the samples at the greatest magnitude,
_ROW = 10  # this many in a row: the signal is cut off there
_STEPS = 12  # values over the whole range: too coarse to fit to
_FEWEST = 200  # samples, for all of these


def channel_findings(robot: Robot, moving: Moving) -> list[LogFinding]:
    """Return the columns that are dead, held, cut off or coarse, and times that jump about."""
    findings = [_jitter(moving)]
    logged = [columns_of(run.signals, robot.joint_names) for run in moving.runs]
    speeds = CHANNELS["dq"].columns(robot.joint_names)  # held against the positions elsewhere
    for column in _columns(robot, moving):
        values = [columns[column] for columns in logged]
        checks = (_held,) if column in speeds else (_dead, _held, _cut_off, _coarse)
        findings.append(next((found for check in checks if (found := check(column, values, moving))), None))
    return [finding for finding in findings if finding is not None]


def _columns(robot: Robot, moving: Moving) -> Iterator[str]:
    """Yield the columns that all runs have, of joints that move and of the whole robot."""
    names = [name for name, moves in zip(robot.joint_names, moving.joints, strict=True) if moves]
    every = set.intersection(*(set(run.signals.logged()) for run in moving.runs))
    for field in sorted(every - {"time", "ddq", "temperature", "command", "command_speed"}):
        yield from CHANNELS[field].columns(names)


def _jitter(moving: Moving) -> LogFinding | None:
    worst = 0.0
    for run in moving.runs:
        gaps = np.diff(run.signals.time)
        worst = max(worst, float(np.median(np.abs(gaps - np.median(gaps)))) / interval(run.signals.time))
    if worst < _JITTER:
        return None
    say = f"the times between samples differ by {worst:.0%} of the interval, as a rule; log at an even rate"
    return LogFinding("jitter", "time", moving.names, False, False, {"share": round(worst, 3)}, say)


def _dead(column: str, values: list[np.ndarray], moving: Moving) -> LogFinding | None:
    regulated = column == CHANNELS["meter_voltage"].prefix and values[0][0] != 0  # a supply that holds its voltage
    if regulated or any(np.ptp(of_run) > 0 for of_run in values):
        return None
    say = f"{column} is {values[0][0]:g} throughout, though the robot moves; connect what measures it, or leave it out"
    return LogFinding("dead", column, moving.names, True, False, {"value": float(values[0][0])}, say)


def _held(column: str, values: list[np.ndarray], moving: Moving) -> LogFinding | None:
    paces = [_pace(of_run) for of_run in values]
    if not all(pace is not None and pace >= 2 for pace in paces):
        return None
    pace = float(np.median([pace for pace in paces if pace is not None]))
    say = f"{column} changes every {pace:g} samples only, as if held in between; straight lines join its changes"
    return LogFinding("held_samples", column, moving.names, True, True, {"samples": pace}, say)


def _pace(values: np.ndarray) -> float | None:
    """Return every how many samples a column changes; None where it does so at no pace."""
    if len(values) < _FEWEST:
        return None
    changes = np.diff(np.flatnonzero(np.diff(values)))
    if len(changes) < _FEWEST / 10:
        return None
    usual = float(np.median(changes))
    return usual if np.mean(changes == usual) > _HELD else None


def _cut_off(column: str, values: list[np.ndarray], moving: Moving) -> LogFinding | None:
    if column.startswith(CHANNELS["q"].prefix + "_"):
        return None  # a joint may stand at its end
    for of_run in values:
        for end in (of_run.max(), of_run.min()):
            at_end = of_run == end
            longest = max((own.stop - own.start for own in stretches(at_end)), default=0)
            if len(of_run) >= _FEWEST and at_end.mean() > _FLAT and longest >= _ROW and np.ptp(of_run) > 0:
                share = float(at_end.mean())
                say = f"{column} stays at {end:.4g} for {share:.1%} of the time, as if cut off there; widen its range"
                return LogFinding(
                    "saturation", column, moving.names, False, False, {"at": float(end), "share": share}, say
                )
    return None


def _coarse(column: str, values: list[np.ndarray], moving: Moving) -> LogFinding | None:
    together = np.concatenate(values)
    count = len(np.unique(together))
    if len(together) < _FEWEST or not 1 < count <= _STEPS:
        return None
    say = f"{column} has {count} different values only; log it with more digits"
    return LogFinding("quantisation", column, moving.names, False, False, {"values": float(count)}, say)
