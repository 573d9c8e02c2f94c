"""Which channel, and which joint's, a column of a log is by its own name, or as the user says."""

from __future__ import annotations

from dataclasses import replace

from irtwin.bring.column_name import Meaning, said_by, word_set, words_of
from irtwin.bring.recording import Recording
from irtwin.bring.rtde_names import JOINTS, PAYLOAD, is_rtde, variable
from irtwin.bring.told import Target
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, Channel, by_column
from irtwin.signals.unit import unit_of

_GEARED = ("q", "dq", "ddq", "torque")  # fields that may be of the motor's side of the gear
_METER = word_set("robot bus supply dc main mains total grid netz ac system sum gesamt meter zwischenkreis")
_GENERIC = word_set("joint axis link")  # words that tell no joint from another
_ALONE = "it names a joint and nothing else, as positions do"


def first_meaning(name: str, recording: Recording, robot: Robot, target: Target | None) -> Meaning:
    """Return what a column's own name, or the user, says."""
    meaning = _by_name(name, recording, robot)
    if target is None:
        return meaning
    if target.field is None:
        return meaning.unused("left out, as --map says")
    same = target.field == meaning.field
    return replace(
        meaning,
        field=target.field,
        joint=target.joint or (meaning.joint if same else _joint_by_words(meaning, robot)),
        unit=target.unit or (meaning.unit if same else None),
        unit_why="as --map says" if target.unit else meaning.unit_why,
        motor=target.motor if target.unit else meaning.motor and target.field in _GEARED,
        why="as --map says",
        weak=False,
        given=True,
    )


def _by_name(name: str, recording: Recording, robot: Robot) -> Meaning:
    if is_rtde(recording.columns):
        said = variable(name)
        if said is None:
            return Meaning(name, None, why=_rtde_unused(name))
        field, unit, index = said
        if index is not None and len(robot.joints) != JOINTS:
            raise InputError(f"{recording.path}: RTDE records {JOINTS} joints, {robot.name} has {len(robot.joints)}")
        joint = None if index is None else robot.joint_names[index]
        by_definition = unit_of(unit, (unit,))
        return Meaning(name, field, joint, by_definition, "by RTDE's definition", why="RTDE's variable")
    exact = by_column(robot.joint_names).get(name)
    if exact is not None:
        return _exact(name, exact, recording, robot)
    unit_text = recording.units.get(name)
    meaning = said_by(name, unit_text)
    return replace(
        meaning,
        joint=_joint_by_words(meaning, robot),
        unit_why=("as the line of units says" if unit_text else "by its name") if meaning.unit else "",
        motor=meaning.motor and meaning.field in _GEARED,
        why=meaning.why or (_ALONE if meaning.weak else "by its name"),
    )


def _rtde_unused(name: str) -> str:
    if name in PAYLOAD:
        return "but as the run's payload"
    return "what the controller wanted" if name.startswith("target_") else "RTDE's, of no channel"


def _exact(name: str, channel: Channel, recording: Recording, robot: Robot) -> Meaning:
    """Return a column that the log format knows; ROS, and a line of units, say its unit, a name alone does not."""
    field = next(field for field, each in CHANNELS.items() if each is channel)
    joint = next((one for one in robot.joints if channel.per_joint and channel.column(one.name) == name), None)
    si = channel.unit_of(joint.kind if joint else "")
    named = recording.units.get(name)
    text = si if recording.is_bag else named
    unit = unit_of(text, (si,)) if text else None
    why = "" if unit is None else "as ROS has it" if recording.is_bag else "as the line of units says"
    return Meaning(name, field, joint.name if joint else None, unit, why, why="its name is the log format's")


def _joint_by_words(meaning: Meaning, robot: Robot) -> str | None:
    """Return the one joint whose name stands in the column's, a word and not a number alone."""
    there = {*meaning.words, *map(str, meaning.numbers)}
    sizes: dict[str, int] = {}
    for joint in robot.joint_names:
        words = set(words_of(joint)) - _GENERIC
        if any(not word.isdigit() for word in words) and words <= there:
            sizes[joint] = len(words)
    best = [joint for joint, size in sizes.items() if size == max(sizes.values())]
    return best[0] if len(best) == 1 else None


def field_of(meaning: Meaning, robot: Robot) -> str | None:
    """Return the field of a column: a current that is of no joint is the supply's."""
    if meaning.field != "current" or meaning.given or meaning.joint is not None:
        return meaning.field
    whole = not meaning.numbers and (len(robot.joints) != 1 or bool(_METER & set(meaning.words)))
    return "meter_current" if whole else "current"
