"""Of the columns that could be a channel, those that are: one a joint, or one of the whole robot."""

from __future__ import annotations

import re
import shlex
from collections import defaultdict
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace

import numpy as np

from irtwin.bring.column_name import Meaning, field_of, first_meaning, said_by, words_of
from irtwin.bring.doubt import DoubtError, WayOut
from irtwin.bring.recording import Recording
from irtwin.bring.told import LEFT_OUT, UserSaid, fits
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS

_TIMES = ("__time", "time", "timestamp")  # the first of these that is there
OF_POWER = ("power", "meter_voltage", "meter_current")
_WORK = (*OF_POWER, "torque", "current", "command")  # without one of these a motion says nothing of its robot
_ARRAY = (frozenset(("joint", "states")), frozenset(("jointstates",)), frozenset(("field",)))  # of ROS' joint states


def meanings(recording: Recording, robot: Robot, told: UserSaid) -> list[Meaning]:
    """Return what each column of a log was taken for.

    Raises DoubtError where that cannot be told, InputError where time or a position is missing.
    """
    first = {name: first_meaning(name, recording, robot, told.of(name)) for name in recording.columns}
    chosen = {name: meaning for name, meaning in first.items() if meaning.field is None}
    for field, channel in CHANNELS.items():
        candidates = [meaning for meaning in first.values() if field_of(meaning, robot) == field]
        choose = _per_joint if channel.per_joint else _of_robot
        chosen |= {meaning.column: meaning for meaning in choose(recording, field, candidates, robot)}
    _check(recording, robot, chosen, {meaning.joint for meaning in first.values() if meaning.field == "q"})
    if not robot.joints and not any(meaning.field in OF_POWER for meaning in chosen.values()):
        raise InputError(
            f"{recording.path}: no column was taken for power or energy; say which it is: --map COLUMN=power:kW, or "
            f"give --robot if joints were logged (there are {', '.join(recording.names)[:400]})"
        )
    _check_work(recording, chosen.values())
    texts = {name: Meaning(name, None, why="holds neither numbers nor times of ISO 8601") for name in recording.texts}
    chosen |= texts
    return [chosen[name] for name in recording.names]


def _per_joint(recording: Recording, field: str, meanings: Sequence[Meaning], robot: Robot) -> list[Meaning]:
    """Return the columns of a channel, each with its joint, and those that are not used."""
    given: dict[str, Meaning] = {
        meaning.joint: meaning for meaning in meanings if meaning.given and meaning.joint is not None
    }
    rest = [meaning for meaning in meanings if meaning not in given.values()]
    if len(given) == len(robot.joints):
        return [*given.values(), *(meaning.unused("others were given by --map") for meaning in rest)]
    strong = [meaning for meaning in rest if not meaning.weak]
    weak = [meaning.unused("its name says no channel") for meaning in rest if meaning.weak and strong]
    sets = _sets(recording, strong or rest, robot, len(given))
    if given and not sets:  # their numbers count on from what was given
        numbered = _sets(recording, [*given.values(), *(strong or rest)], robot, 0)
        sets = [
            by_joint
            for by_joint in numbered
            if all(by_joint[name].column == meaning.column for name, meaning in given.items())
        ]
    if len(sets) > 1 and (
        measured := [by_joint for by_joint in sets if all(meaning.measured for meaning in by_joint.values())]
    ):
        sets = measured if len(measured) == 1 else sets
    if len(sets) > 1:
        raise _several(recording, field, [[meaning.column for meaning in by_joint.values()] for by_joint in sets])
    taken = {**(sets[0] if sets else {}), **given}
    if len(taken) < len(robot.joints):
        label = CHANNELS[field].label
        lone = "the log format has it of each joint, or of none"
        unknown = [*given.values(), *(strong or rest)]
        return [*(meaning.unused(f"no {label} of a joint that is known: {lone}") for meaning in unknown), *weak]
    used = {meaning.column for meaning in taken.values()}
    others = [
        meaning.unused("other columns were taken for the robot's joints")
        for meaning in strong or rest
        if meaning.column not in used
    ]
    return [*taken.values(), *others, *weak]


def _sets(recording: Recording, meanings: Sequence[Meaning], robot: Robot, known: int) -> list[dict[str, Meaning]]:
    """Return the sets of columns, one for each joint, whose names differ in the joint alone."""
    names = robot.joint_names
    groups: dict[tuple[str, ...], list[Meaning]] = defaultdict(list)
    for meaning in meanings:
        of_joint = set(words_of(meaning.joint)) if meaning.joint else set()
        groups[tuple(word for word in meaning.words if word not in of_joint)].append(meaning)
    complete = []
    for group in groups.values():
        by_joint = {meaning.joint: meaning for meaning in group if meaning.joint}
        if len(by_joint) == len(group) and len(group) >= len(names) - known:
            complete.append({str(joint): meaning for joint, meaning in by_joint.items()})
        elif indexed := _by_number(recording, group, names):
            complete.append(indexed)
        elif len(group) == len(names) == 1:
            complete.append({names[0]: group[0]})
    if not complete and meanings and len(meanings) == len(names):
        indexed = _by_number(recording, meanings, names)  # names that differ in more than the number
        complete = [indexed] if indexed else []
    return complete


def _by_number(recording: Recording, group: Sequence[Meaning], names: Sequence[str]) -> dict[str, Meaning]:
    """Return the joint of each column by a number in its name, that counts from 0 or 1, base to flange."""
    if len(group) < len(names) or len({len(meaning.numbers) for meaning in group}) != 1:
        return {}
    if len(group) > len(names):
        group = _without_others(recording, group, len(names))
    for place in range(len(group[0].numbers)):
        numbers = [meaning.numbers[place] for meaning in group]
        start = min(numbers)
        if (
            start in (0, 1)
            and len(set(numbers)) == len(group)
            and sorted(numbers)[: len(names)] == list(range(start, start + len(names)))
            and len(group) == len(names)
        ):
            if any(words <= set(group[0].words) for words in _ARRAY) and not group[0].given:
                raise _in_any_order(recording, group, names)
            why = f"{group[0].why}; its number counts joints from {start}, base to flange"
            return {
                names[number - start]: replace(meaning, joint=names[number - start], why=why)
                for number, meaning in zip(numbers, group, strict=True)
            }
    return {}


def _without_others(recording: Recording, group: Sequence[Meaning], count: int) -> Sequence[Meaning]:
    """Return the first columns of more than the robot's joints: axes that never move are no axes of it."""
    ordered = sorted(group, key=lambda meaning: meaning.numbers)
    others = [meaning.column for meaning in ordered[count:]]
    if any(np.ptp(recording.columns[name][np.isfinite(recording.columns[name])]) > 0 for name in others):
        raise InputError(
            f"{recording.path}: columns {_shown([meaning.column for meaning in ordered])} are of {len(group)} joints, "
            f"the robot has {count}; leave out what is not of it, as --map {others[0]}={LEFT_OUT}"
        )
    return ordered[:count]


def _in_any_order(recording: Recording, group: Sequence[Meaning], names: Sequence[str]) -> DoubtError:
    """Return the doubt about numbers of an array of ROS, whose joints come in any order."""
    columns = [meaning.column for meaning in group]
    field = str(group[0].field)
    prefix = CHANNELS[field].prefix
    pattern = _pattern(columns[0])
    return DoubtError(
        f"{recording.path}: columns {_shown(columns)} are numbered as in a message of ROS, whose joints come in any "
        f"order, often that of their letters; say each, as --map {columns[0]}={prefix}_{names[0]}, or that they go "
        "from base to flange",
        [WayOut("they go from base to flange", (("--map", f"{pattern}={prefix}"),))],
    )


def _of_robot(recording: Recording, field: str, meanings: Sequence[Meaning], robot: Robot) -> list[Meaning]:
    """Return the one column of a channel of the whole robot, and those that are not used."""
    label = CHANNELS[field].label
    given = [meaning for meaning in meanings if meaning.given]
    rest = [meaning for meaning in meanings if not meaning.given]
    of_joints = [meaning for meaning in rest if meaning.joint is not None or (meaning.numbers and field != "time")]
    unused = [meaning.unused(f"{label} of a part; the log format has the whole robot's") for meaning in of_joints]
    rest = [meaning for meaning in rest if meaning not in of_joints]
    if field == "time" and not given:
        numbered = [meaning for meaning in rest if meaning.numbers]  # T1 is no time where t is
        if 0 < len(numbered) < len(rest):
            if len(numbered) == len(robot.joints):
                raise _torque_or_temperature(recording, numbered)
            unused += [meaning.unused("numbered, beside a time that is not") for meaning in numbered]
            rest = [meaning for meaning in rest if meaning not in numbered]
        first = [meaning for name in _TIMES for meaning in rest if meaning.column.strip().lower() == name]
        given = first[:1]
    if given:
        why = f"{given[0].column} was taken"
        return [
            replace(given[0], field=field),
            *(meaning.unused(why) for meaning in [*given[1:], *rest] if meaning != given[0]),
            *unused,
        ]
    if len(rest) > 1:
        measured = [meaning for meaning in rest if meaning.measured]
        if len(measured) != 1:
            raise _several(recording, field, [[meaning.column] for meaning in rest])
        unused += [meaning.unused(f"{measured[0].column} was taken") for meaning in rest if meaning != measured[0]]
        rest = measured
    return [*(replace(meaning, field=field) for meaning in rest), *unused]


def _torque_or_temperature(recording: Recording, meanings: Sequence[Meaning]) -> DoubtError:
    columns = [meaning.column for meaning in meanings]
    pattern = _pattern(columns[0])
    ways = [pattern] if [name for name in recording.columns if fits(pattern, name)] == columns else columns
    answers = [
        WayOut(f"{words} of the joints", tuple(("--map", f"{way}={CHANNELS[field].prefix}") for way in ways))
        for field, words in (("torque", "torques"), ("temperature", "temperatures"))
    ]
    return DoubtError(f"{recording.path}: columns {_shown(columns)} could be torques or temperatures", answers)


def _several(recording: Recording, field: str, sets: Sequence[Sequence[str]]) -> DoubtError:
    answers = []
    for chosen in sets:
        others = [column for columns in sets if columns is not chosen for column in columns]
        patterns = {_pattern(column) for column in others}
        if not any(fits(pattern, column) for pattern in patterns for column in chosen):
            others = sorted(patterns)
        options = tuple(("--map", f"{column}={LEFT_OUT}") for column in others)
        answers.append(WayOut(f"take {_shown(chosen)}, leave out {_shown(others)}", options))
    both = " and ".join(_shown(columns) for columns in sets)
    return DoubtError(f"{recording.path}: columns {both} could each be {CHANNELS[field].label}", answers)


def _pattern(column: str) -> str:
    return re.sub(r"\d+", "*", column)


def _shown(columns: Sequence[str]) -> str:
    return columns[0] if len(columns) == 1 else f"{columns[0]} to {columns[-1]}"


def _check(recording: Recording, robot: Robot, chosen: Mapping[str, Meaning], seen: Collection[str | None]) -> None:
    positions = {meaning.joint for meaning in chosen.values() if meaning.field == "q"}
    lacking = [name for name in robot.joint_names if name not in positions]
    missing = [name for name in lacking if name not in seen] or lacking
    timed = any(meaning.field == "time" for meaning in chosen.values())
    if missing or not timed:
        some = 0 < len(missing) < len(robot.joints)
        others = f" and {len(missing) - 1} other joints" if some and missing[1:] else ""
        lacked = f"the position of {missing[0]}{others}" if missing else "the time"
        (column,) = CHANNELS["q" if missing else "time"].columns(missing[:1])
        fixed = " ".join(f"--fixed {shlex.quote(joint)}" for joint in missing)
        held = f", or, where they stood still, {fixed}" if some else ""
        times = [name for name in recording.texts if not timed and said_by(name).field == "time"]
        if times:
            raise InputError(
                f"{recording.path}: column {times[0]} holds neither numbers nor dates and times of ISO 8601, as "
                "2026-03-02T08:00:00.012; convert it"
            )
        there = ", ".join(recording.names)
        shown = there if len(there) < 400 else f"{there[:400]} ..."
        named = ", or --names A,B,..., left to right" if recording.names[0] == "column_1" else ""
        raise InputError(
            f"{recording.path}: no column was taken for {lacked}; say which it is: --map COLUMN={column}{named}{held} "
            f"(there are {shown})"
        )


def _check_work(recording: Recording, chosen: Collection[Meaning]) -> None:
    """Raise InputError where nothing was taken that moves the robot, or that it takes, and some columns may be that."""
    unknown = [meaning.column for meaning in chosen if meaning.field is None]
    if unknown and not any(meaning.field in _WORK for meaning in chosen):
        shown = " or ".join(f"--map {shlex.quote(f'{_pattern(unknown[0])}={prefix}')}" for prefix in ("tau", "i"))
        raise InputError(
            f"{recording.path}: no column was taken for torque, motor current or power; say which they are, such as "
            f"{shown} (not used are {', '.join(unknown)[:400]})"
        )
