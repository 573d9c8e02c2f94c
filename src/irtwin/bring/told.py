"""What the user says of logs on the command line: what columns are, and whose logs those are."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, by_column
from irtwin.signals.log import POWER_PLACES, ROLES
from irtwin.signals.unit import MOTOR, Unit, unit_of

LEFT_OUT = "-"


@dataclass(frozen=True)
class Target:
    """What a column was said to be: `field` of Signals, None to leave it out; `joint`, `unit` where they were said."""

    field: str | None
    joint: str | None = None
    unit: Unit | None = None
    motor: bool = False


@dataclass(frozen=True)
class UserSaid:
    """What the user says: columns (`*` stands for any letters) with what they are; gear ratios by joint; power_at."""

    columns: Mapping[str, Target] = field(default_factory=dict)
    gear_ratios: Mapping[str, float] = field(default_factory=dict)
    power_at: str | None = None

    def of(self, column: str) -> Target | None:
        """Return what was said of a column: of it alone before what is said of many."""
        patterns = (pattern for pattern in self.columns if fits(pattern, column))
        closest = max(patterns, key=lambda pattern: (pattern == column, len(pattern)), default=None)
        return None if closest is None else self.columns[closest]

    def check(self, columns: Iterable[str]) -> None:
        """Raise InputError where something was said of a column that no file has."""
        names = list(columns)
        for pattern in self.columns:
            if not any(fits(pattern, name) for name in names):
                raise InputError(f"--map {pattern}=...: no file has such a column; there are {', '.join(names[:12])}")


def told(maps: Iterable[str], ratios: Iterable[str], power_at: str | None, robot: Robot) -> UserSaid:
    """Read what the options say. Raises InputError, naming the option and what may stand there."""
    if power_at is not None and power_at not in POWER_PLACES:
        raise InputError(f"--power-at {power_at}: use {' or '.join(POWER_PLACES)}")
    gears: dict[str, float] = {
        joint.name: joint.gear_ratio for joint in robot.joints if joint.gear_ratio is not None and joint.gear_ratio > 0
    }
    for text in ratios:
        gears |= _ratios(text, robot)
    return UserSaid(dict(_target(text, robot) for text in maps), gears, power_at)


def fits(pattern: str, name: str) -> bool:
    """Whether a pattern, in which * stands for any letters, is of a name."""
    return re.fullmatch(".*".join(map(re.escape, pattern.split("*"))), name, re.DOTALL) is not None


def _ratios(text: str, robot: Robot) -> dict[str, float]:
    joint, _, number = text.rpartition("=")
    try:
        ratio = float(number)
    except ValueError:
        ratio = 0.0
    if not 0 < ratio < 1e6:
        raise InputError(f"--gear-ratio {text}: give RATIO or JOINT=RATIO, motor turns for one of the joint, as 100")
    if joint and joint not in robot.joint_names:
        raise InputError(f'--gear-ratio {text}: the robot has no joint "{joint}" (it has {_names(robot)})')
    return {name: ratio for name in robot.joint_names if joint in ("", name)}


def _target(text: str, robot: Robot) -> tuple[str, Target]:
    column, sign, target = text.rpartition("=")
    if not sign or not column:
        raise InputError(
            f"--map {text}: give COLUMN=CHANNEL or COLUMN=CHANNEL:UNIT, as J1=q_{robot.joint_names[0]}:deg"
        )
    if target == LEFT_OUT:
        return column, Target(None)
    known = by_column(robot.joint_names)
    channel, unit_text = target, ""
    if target not in known and ":" in target:
        channel, _, unit_text = target.rpartition(":")
    fields = [
        name
        for name, candidate in CHANNELS.items()
        if channel in (candidate.prefix, *candidate.columns(robot.joint_names))
    ]
    if not fields:
        prefixes = ", ".join(each.prefix for each in CHANNELS.values())
        raise InputError(
            f"--map {text}: {channel} is no channel; use {prefixes}, with _JOINT where it is of a joint "
            f"({_names(robot)}), or - to leave the column out"
        )
    field_name = fields[0]
    chosen = CHANNELS[field_name]
    joint = next((name for name in robot.joint_names if chosen.per_joint and chosen.column(name) == channel), None)
    quantities = tuple(
        {chosen.unit_of(axis.kind) for axis in robot.joints if joint in (None, axis.name)} or {chosen.unit}
    )
    motor = unit_text.startswith(MOTOR)
    unit = unit_of(unit_text.removeprefix(MOTOR), quantities) if unit_text else None
    if unit_text and unit is None:
        raise InputError(
            f"--map {text}: {unit_text} is no unit of {chosen.label}; its SI unit is {' or '.join(quantities)}"
        )
    return column, Target(field_name, joint, unit, motor)


def _names(robot: Robot) -> str:
    return ", ".join(robot.joint_names)


def roles(files: Sequence[Path], texts: Iterable[str]) -> Mapping[Path, str]:
    """Return each file's role, as ROLE and FILE=ROLE say, the last that fits it; else "observed".

    FILE is a path as it is given or a name, with * for any letters. Raises InputError where one names no role or file.
    """
    by_file = dict.fromkeys(files, ROLES[0])
    for text in texts:
        pattern, _, role = text.rpartition("=")
        if role not in ROLES:
            raise InputError(f"--role {text}: give ROLE or FILE=ROLE, where ROLE is {', '.join(ROLES)}")
        named = [file for file in files if not pattern or any(fits(pattern, name) for name in (str(file), file.name))]
        if not named:
            raise InputError(f"--role {text}: no such file is brought; there are {', '.join(map(str, files[:12]))}")
        by_file |= dict.fromkeys(named, role)
    return by_file
