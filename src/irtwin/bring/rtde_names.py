"""Recordings of Universal Robots' RTDE, whose variables have a meaning and a unit by definition."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence

import numpy as np

from irtwin.bring.recording import Recording
from irtwin.errors import InputError

POWER_AT = "dc_bus"  # actual_robot_voltage and actual_robot_current are those of the arm's 48 V
JOINTS = 6
# variable: field of Signals, unit
_VARIABLES = {
    "timestamp": ("time", "s"),
    "actual_q": ("q", "rad"),
    "actual_qd": ("dq", "rad/s"),
    "actual_current": ("current", "A"),
    "actual_current_as_torque": ("torque", "N m"),
    "joint_temperatures": ("temperature", "degC"),
    "actual_robot_voltage": ("meter_voltage", "V"),
    "actual_robot_current": ("meter_current", "A"),
}
PAYLOAD = ("payload", "payload_cog_0", "payload_cog_1", "payload_cog_2")  # of a run, not of a sample
_INDEXED = re.compile(r"(.+)_([0-5])")


def is_rtde(columns: Collection[str]) -> bool:
    """Whether these are the columns that UR's record.py writes, or ur_rtde."""
    return all(f"actual_q_{joint}" in columns for joint in range(JOINTS))


def variable(column: str) -> tuple[str, str, int | None] | None:
    """Return field, unit and joint (None of the whole robot) of a column; None where it is not used."""
    indexed = _INDEXED.fullmatch(column)
    name, joint = (indexed[1], int(indexed[2])) if indexed else (column, None)
    known = _VARIABLES.get(name)
    return None if known is None else (*known, joint)


def payload(recording: Recording) -> tuple[float, tuple[float, float, float]] | None:
    """Return what the controller was told of its load, kg and m in the flange frame; None where that is not recorded.

    Raises InputError where it changes within the log: a run has one payload.
    """
    mass = _constant(recording, recording.columns, PAYLOAD[:1])
    if mass is None:
        return None
    centre = _constant(recording, recording.columns, PAYLOAD[1:])
    x, y, z = centre if centre is not None else (0.0, 0.0, 0.0)
    return mass[0], (x, y, z)


def _constant(recording: Recording, columns: Mapping[str, np.ndarray], names: Sequence[str]) -> list[float] | None:
    if any(name not in columns for name in names):
        return None
    for name in names:
        values = columns[name][np.isfinite(columns[name])]
        if not len(values):
            return None
        if np.ptp(values) > 0:
            row = int(np.flatnonzero(columns[name] != columns[name][0])[0])
            raise InputError(
                f"{recording.path}, {recording.place(row)}, column {name}: the payload changes; cut the log "
                "there into two"
            )
    return [float(columns[name][0]) for name in names]
