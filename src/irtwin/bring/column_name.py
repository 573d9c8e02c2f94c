"""What a column of a log is by its own name, or as the user says: a channel, a joint, a unit."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from irtwin.bring.recording import Recording
from irtwin.bring.rtde_names import JOINTS, PAYLOAD, is_rtde, variable
from irtwin.bring.told import Target
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, Channel, by_column
from irtwin.signals.unit import QUANTITIES, Unit, unit_of

_GEARED = ("q", "dq", "ddq", "torque")  # fields that may be of the motor's side of the gear
_ALONE = "it names a joint and nothing else, as positions do"


def _word_set(text: str) -> frozenset[str]:
    """Return the words of a text."""
    return frozenset(text.split())


# words, in small letters, by field of Signals; of several in a name the last one counts
_WORDS = {
    "time": "time timestamp stamp datetime date datum zeit uhrzeit zeitstempel clock elapsed t",
    "q": "q pos position positions ang angle angles winkel theta act position_actual istposition lage jointposition",
    "dq": "dq qd qdot vel velocity velocities speed speeds omega geschwindigkeit drehzahl",
    "ddq": "ddq qdd qddot acc accel acceleration accelerations beschleunigung",
    "torque": "tau torque torques trq effort efforts mom moment moments momente drehmoment drehmomente",
    "current": "i iq current currents curr cur strom motorstrom",
    "temperature": "temp temps temperature temperatures temperatur",
    "power": "power pwr leistung wirkleistung",
    "meter_voltage": "voltage volt u spannung",
}
_FIELD = {word: field for field, words in _WORDS.items() for word in words.split()}
_WEAK = _word_set("joint axis achse j a axes joints gelenk")  # alone with a number, a joint's position
_MEASURED = _word_set("actual act measured meas ist real feedback fbk")
_NOT_MEASURED = _word_set(
    "target targets desired des cmd command commanded setpoint set soll sollwert ref reference goal error "
    "err ff feedforward limit max min mode model predicted estimated planned"
)
_ELSEWHERE = _word_set(
    "tcp cartesian tool wrench force forces imu orientation quaternion pose accelerometer ambient header nsecs"
)
_MAGNITUDE = _word_set("abs absolute magnitude")
_MOTOR = _word_set("motor mot motors drive rotor antrieb encoder enc")
_METER = _word_set("robot bus supply dc main mains total grid netz ac system sum gesamt meter zwischenkreis")
_GENERIC = _word_set("joint axis link")  # words that tell no joint from another
_LONGEST = 12  # parts of a name that may write a unit, and what joins them: rad per s 2 has seven
_TOKEN = re.compile(r"[^\W\d_]+|\d+")
_BRACKETS = re.compile(r"\s*[\[(]\s*([^\[\]()]+?)\s*[\])]\s*$")
_CAMEL = re.compile(r"(?<=[a-zäöü])(?=[A-ZÄÖÜ])")


@dataclass(frozen=True)
class Meaning:
    """What a column was taken for, and `why`; `field` of Signals, None where it is not used; `joint`: its name.

    `words`: those of its name but those that say measured; `numbers`: those of its name; `weak`: it says a joint and no
    channel; `given`: the user said it.
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


def said_by(name: str, unit_text: str | None = None) -> Meaning:
    """Return what a column's name says; `unit_text` is what the file says of its unit beside the name."""
    bare, text = _split(name)
    tokens = words_of(bare)
    words = tuple(token for token in tokens if not token.isdigit())
    numbers = tuple(int(token) for token in tokens if token.isdigit() and len(token) < 10)
    field = next((_FIELD[word] for word in reversed(words) if word in _FIELD), None)
    if words == ("p",) and not numbers:
        field = "power"  # p1 could be a position, or a pressure
    unit = _unit(field, unit_text or text) if field is not None else None
    if unit is None and field is not None and (within := _unit_within(bare, field)) is not None:
        rest, unit = within
        return replace(said_by(rest), column=name, unit=unit)
    measured, motor = bool(_MEASURED & set(words)), bool(_MOTOR & set(words))
    kept = tuple(word for word in words if word not in _MEASURED)
    weak = field is None and bool(words) and set(kept) <= _WEAK and len(numbers) == 1
    if field is None:
        any_unit = unit_of(unit_text or text or "", QUANTITIES)
        of_unit = (
            name for name, channel in CHANNELS.items() if any_unit and any_unit.si in (channel.unit, channel.sliding)
        )
        field = next(of_unit, None)
        unit = any_unit if field is not None else None
        weak = weak and field is None
    if weak:
        field = "q"  # as positions are often logged; their range is held against the joints' limits
    why = _unused(words, field)
    return Meaning(
        name, None if why else field, unit=unit, motor=motor, why=why, words=kept, numbers=numbers, measured=measured,
        weak=weak,
    )  # fmt: skip


def _unused(words: tuple[str, ...], field: str | None) -> str:
    if wanted := next((word for word in words if word in _NOT_MEASURED), None):
        return f'"{wanted}": what was wanted, not what was measured'
    if other := next((word for word in words if word in _ELSEWHERE), None):
        return f'"{other}": of no joint and no meter'
    if field in ("torque", "current") and (size := next((word for word in words if word in _MAGNITUDE), None)):
        return f'"{size}": a magnitude, without its sign'
    return "" if field else "its name says no channel"


def _split(name: str) -> tuple[str, str | None]:
    """Return a name without the unit in brackets at its end, and that text; a number there is an index."""
    bracket = _BRACKETS.search(name)
    if bracket is None or bracket[1].isdigit():
        return name, None
    return name[: bracket.start()], bracket[1]


def _unit(field: str, text: str | None) -> Unit | None:
    channel = CHANNELS[field]
    return unit_of(text, tuple(si for si in (channel.unit, channel.sliding) if si)) if text else None


def _unit_within(name: str, field: str) -> tuple[str, Unit] | None:
    """Return a name without the unit of its field that stands in it, as deg_s does, and that unit."""
    parts = re.split(r"([_\s.\-]+)", name)  # texts at even places
    starts = range(0, len(parts), 2)
    spans = [(start, stop) for start in starts for stop in range(start + 1, min(start + _LONGEST, len(parts) + 1), 2)]
    for start, stop in sorted(spans, key=lambda span: span[0] - span[1]):
        text, rest = "".join(parts[start:stop]), "".join(parts[:start] + parts[stop:])
        at_end = stop == len(parts)
        unit = _unit(field, text) if at_end or len(text) > 1 else None
        if unit is not None and any(word in _FIELD for word in words_of(rest)):
            return rest, unit
    return None


def words_of(name: str) -> list[str]:
    """Return the words and numbers of a name, in small letters."""
    return [token.lower() for token in _TOKEN.findall(_CAMEL.sub(" ", name))]


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
        known = variable(name)
        if known is None:
            return Meaning(name, None, why=_rtde_unused(name))
        field, unit, index = known
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
    field = next(field for field, known in CHANNELS.items() if known is channel)
    joint = next((axis for axis in robot.joints if channel.per_joint and channel.column(axis.name) == name), None)
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
