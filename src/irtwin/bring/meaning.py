"""Which channel, and which joint's, each column of a log is."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from irtwin.bring.column_name import said_by, words_of
from irtwin.bring.doubt import Answer, DoubtError
from irtwin.bring.recording import Recording
from irtwin.bring.rtde_names import JOINTS, PAYLOAD, is_rtde, variable
from irtwin.bring.told import LEFT_OUT, Target, Told
from irtwin.bring.unit import Unit, unit_of
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, Channel, by_column

_GEARED = ("q", "dq", "ddq", "torque")  # fields that may be of the motor's side of the gear
_METER = frozenset(
    [
        "robot",
        "bus",
        "supply",
        "dc",
        "main",
        "mains",
        "total",
        "grid",
        "netz",
        "ac",
        "system",
        "sum",
        "gesamt",
        "meter",
        "zwischenkreis",
    ]
)
_GENERIC = frozenset(["joint", "axis", "link"])  # words that tell no joint from another
_TIMES = ("__time", "time", "timestamp")  # the first of these that is there


@dataclass(frozen=True)
class Meaning:
    """What a column was taken for; `field` of Signals, None where it is not used; `joint`: its name.

    `words` and `numbers` are those of its name; `weak`: it says a joint and no channel; `given`: the user said it.
    """

    column: str
    field: str | None
    joint: str | None = None
    unit: Unit | None = None
    unit_why: str = ""
    motor: bool = False
    why: str = ""
    words: tuple[str, ...] = ()
    numbers: tuple[int, ...] = ()
    measured: bool = False
    weak: bool = False
    given: bool = False

    def unused(self, why: str) -> Meaning:
        """Return it as a column that is not used."""
        return replace(self, field=None, joint=None, unit=None, why=why)


def meanings(recording: Recording, robot: Robot, told: Told) -> list[Meaning]:
    """Return what each column of a log was taken for.

    Raises DoubtError where that cannot be told, InputError where time or a position is missing.
    """
    first = {name: _first(name, recording, robot, told.of(name)) for name in recording.columns}
    chosen = {name: each for name, each in first.items() if each.field is None}
    for field, channel in CHANNELS.items():
        candidates = [each for each in first.values() if _field(each, robot) == field]
        choose = _per_joint if channel.per_joint else _of_robot
        chosen |= {each.column: each for each in choose(recording, field, candidates, robot)}
    _check(recording, robot, chosen)
    texts = {name: Meaning(name, None, why="holds neither numbers nor times of ISO 8601") for name in recording.texts}
    return [{**chosen, **texts}[name] for name in recording.names]


def _first(name: str, recording: Recording, robot: Robot, target: Target | None) -> Meaning:
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
    unit_text = recording.units.get(name)
    said_name = said_by(name, unit_text)
    if exact is not None:
        return _exact(name, exact, recording, robot)
    meaning = Meaning(
        name,
        said_name.field,
        None,
        said_name.unit,
        ("as the line of units says" if unit_text else "by its name") if said_name.unit else "",
        said_name.motor and said_name.field in _GEARED,
        said_name.why or "by its name",
        said_name.words,
        said_name.numbers,
        said_name.measured,
        said_name.weak,
    )
    return replace(meaning, joint=_joint_by_words(meaning, robot))


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


def _field(meaning: Meaning, robot: Robot) -> str | None:
    """Return the field of a column: a current that is of no joint is the supply's."""
    if meaning.field != "current" or meaning.given or meaning.joint is not None:
        return meaning.field
    whole = not meaning.numbers and (len(robot.joints) > 1 or bool(_METER & set(meaning.words)))
    return "meter_current" if whole else "current"


def _per_joint(recording: Recording, field: str, found: Sequence[Meaning], robot: Robot) -> list[Meaning]:
    """Return the columns of a channel, each with its joint, and those that are not used."""
    given: dict[str, Meaning] = {each.joint: each for each in found if each.given and each.joint is not None}
    rest = [each for each in found if each not in given.values()]
    if len(given) == len(robot.joints):
        return [*given.values(), *(each.unused("others were given by --map") for each in rest)]
    strong = [each for each in rest if not each.weak]
    weak = [each.unused("its name says no channel") for each in rest if each.weak and strong]
    sets = _sets(strong or rest, robot, len(given))
    if len(sets) > 1 and (measured := [one for one in sets if all(each.measured for each in one.values())]):
        sets = measured if len(measured) == 1 else sets
    if len(sets) > 1:
        raise _several(recording, field, [[each.column for each in one.values()] for one in sets])
    taken = {**(sets[0] if sets else {}), **given}
    if len(taken) < len(robot.joints):
        label = CHANNELS[field].label
        lone = "the log format has it of each joint, or of none"
        return [*(each.unused(f"no {label} of a joint that is known: {lone}") for each in strong or rest), *weak]
    used = {each.column for each in taken.values()}
    others = [each.unused("another column was taken") for each in strong or rest if each.column not in used]
    return [*taken.values(), *others, *weak]


def _sets(found: Sequence[Meaning], robot: Robot, known: int) -> list[dict[str, Meaning]]:
    """Return the sets of columns, one for each joint, whose names differ in the joint alone."""
    names = robot.joint_names
    groups: dict[tuple[str, ...], list[Meaning]] = defaultdict(list)
    for each in found:
        of_joint = set(words_of(each.joint)) if each.joint else set()
        groups[tuple(word for word in each.words if word not in of_joint)].append(each)
    complete = []
    for group in groups.values():
        by_joint = {each.joint: each for each in group if each.joint}
        if len(by_joint) == len(group) and len(group) >= len(names) - known:
            complete.append({str(joint): each for joint, each in by_joint.items()})
        elif indexed := _by_number(group, names):
            complete.append(indexed)
        elif len(group) == len(names) == 1:
            complete.append({names[0]: group[0]})
    if not complete and found and len(found) == len(names):
        indexed = _by_number(found, names)  # names that differ in more than the number
        complete = [indexed] if indexed else []
    return complete


def _by_number(group: Sequence[Meaning], names: Sequence[str]) -> dict[str, Meaning]:
    """Return the joint of each column by a number in its name, that counts from 0 or 1, base to flange."""
    if len(group) < len(names) or len({len(each.numbers) for each in group}) != 1:
        return {}
    for place in range(len(group[0].numbers)):
        numbers = [each.numbers[place] for each in group]
        start = min(numbers)
        if (
            start in (0, 1)
            and len(set(numbers)) == len(group)
            and sorted(numbers)[: len(names)] == list(range(start, start + len(names)))
            and len(group) == len(names)
        ):
            why = f"{group[0].why}; its number counts joints from {start}, base to flange"
            return {
                names[number - start]: replace(each, joint=names[number - start], why=why)
                for number, each in zip(numbers, group, strict=True)
            }
    return {}


def _of_robot(recording: Recording, field: str, found: Sequence[Meaning], robot: Robot) -> list[Meaning]:
    """Return the one column of a channel of the whole robot, and those that are not used."""
    label = CHANNELS[field].label
    given = [each for each in found if each.given]
    rest = [each for each in found if not each.given]
    of_joints = [each for each in rest if each.joint is not None or (each.numbers and field != "time")]
    unused = [each.unused(f"{label} of a part; the log format has the whole robot's") for each in of_joints]
    rest = [each for each in rest if each not in of_joints]
    if field == "time" and not given:
        first = [each for name in _TIMES for each in rest if each.column.strip().lower() == name]
        given = first[:1]
    if given:
        why = f"{given[0].column} was taken"
        return [
            replace(given[0], field=field),
            *(each.unused(why) for each in [*given[1:], *rest] if each != given[0]),
            *unused,
        ]
    if len(rest) > 1:
        measured = [each for each in rest if each.measured]
        if len(measured) != 1:
            raise _several(recording, field, [[each.column] for each in rest])
        unused += [each.unused(f"{measured[0].column} was taken") for each in rest if each != measured[0]]
        rest = measured
    return [*(replace(each, field=field) for each in rest), *unused]


def _several(recording: Recording, field: str, sets: Sequence[Sequence[str]]) -> DoubtError:
    answers = []
    for chosen in sets:
        others = [column for columns in sets if columns is not chosen for column in columns]
        options = tuple(("--map", f"{column}={LEFT_OUT}") for column in others)
        answers.append(Answer(f"take {_shown(chosen)}, leave out {_shown(others)}", options))
    both = " and ".join(_shown(columns) for columns in sets)
    return DoubtError(f"{recording.path}: columns {both} could each be {CHANNELS[field].label}", answers)


def _shown(columns: Sequence[str]) -> str:
    return columns[0] if len(columns) == 1 else f"{columns[0]} to {columns[-1]}"


def _check(recording: Recording, robot: Robot, chosen: Mapping[str, Meaning]) -> None:
    positions = {each.joint for each in chosen.values() if each.field == "q"}
    missing = [name for name in robot.joint_names if name not in positions]
    timed = any(each.field == "time" for each in chosen.values())
    if missing or not timed:
        what, column = (f"the position of {missing[0]}", f"q_{missing[0]}") if missing else ("the time", "time")
        there = ", ".join(recording.names)
        shown = there if len(there) < 400 else f"{there[:400]} ..."
        raise InputError(
            f"{recording.path}: no column was taken for {what}; say which it is: --map COLUMN={column} "
            f"(there are {shown})"
        )
