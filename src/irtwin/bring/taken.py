"""Columns of logs of one form as channels of the log format, in SI units, and what each was taken for."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime, timedelta

import numpy as np

from irtwin.bring import evidence
from irtwin.bring.aligned import Aligned, aligned
from irtwin.bring.choice import OF_POWER, meanings
from irtwin.bring.column_name import Meaning
from irtwin.bring.doubt import DoubtError, WayOut
from irtwin.bring.evidence import MeasuredRun, UnitEvidence
from irtwin.bring.recording import Recording
from irtwin.bring.rtde_names import POWER_AT, is_rtde
from irtwin.bring.told import LEFT_OUT, UserSaid
from irtwin.check.torque import has_no_sign
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS, Channel
from irtwin.signals.samples import UNSIGNED
from irtwin.signals.unit import MOTOR, Unit, units

_EPOCH = (946_684_800.0, 4_102_444_800.0)  # s since 1970: of the years 2000 to 2099
_CURRENT = (0.3, 100.0)  # A of a motor, at its greatest
_VOLTAGE = (10.0, 1000.0)  # V of a supply
_SUPPLY = (0.1, 200.0)  # A of a supply
_WARM = (-30.0, 130.0)  # degC
_MAINS = frozenset(["mains", "grid", "netz", "ac", "wall"])
_BUS = frozenset(["bus", "dc", "dclink", "zwischenkreis"])
Look = Callable[[list[np.ndarray], list[int], str], UnitEvidence]  # at values as logged, of joints, in an SI unit
Units = dict[str, tuple[Unit, str]]  # by column: its unit, and how that was told


@dataclass(frozen=True)
class Taken:
    """What a column was taken for: `channel` is the log format's column, "" where it is not used."""

    column: str
    channel: str = ""
    unit: str = ""
    conversion: str = ""
    why: str = ""


@dataclass(frozen=True)
class TakenRun:
    """A run in the log format's columns, SI units; `started`, where its times say it."""

    columns: Mapping[str, np.ndarray]
    started: datetime | None


class LogsAlike:
    """Logs of the same columns, taken together as runs: what one of them tells of a unit holds for all.

    `columns`: what each was taken for; `power_at`: where power was measured, None where it was not; `said`: a line for
    each thing that was done in reading.
    """

    def __init__(self, logs: Sequence[Recording], robot: Robot, told: UserSaid, repair: bool) -> None:
        """Take them. Raises DoubtError where a column's meaning or unit, or a place, cannot be told."""
        self.logs, self.robot, self.told = logs, robot, told
        self.meanings = meanings(logs[0], robot, told)
        self.usable = [aligned(log, self.meanings, repair=repair) for log in logs]
        self.said = [line for log in self.usable for line in (*log.recording.said, *log.said)]
        self.where = ", ".join(str(log.path) for log in logs[:3]) + (" ..." if len(logs) > 3 else "")
        self.units: Units = {}
        self.motions: list[MeasuredRun] = []
        self.unsigned = False  # torque, of no use beside commands
        seconds, started = self._find_units()
        self.power_at, self.power_at_why = self._power_at()
        self.columns = tuple(self._row(meaning) for meaning in self.meanings)
        self.runs = tuple(
            TakenRun(self._columns(log, time), start)
            for log, time, start in zip(self.usable, seconds, started, strict=True)
        )

    def _find_units(self) -> tuple[list[np.ndarray], list[datetime | None]]:
        """Find the unit of each column; return the times of each log, s, and when it started."""
        self._resolve("q", self._position)
        self._resolve("command", self._position)
        positions = self._si("q")
        seconds, started = self._seconds(positions)
        self.motions = [MeasuredRun(*pair) for pair in zip(seconds, positions, strict=True)]
        self._resolve("dq", lambda raw, joints, si: evidence.rate(self.motions, raw, joints, si))
        self._resolve("ddq", lambda raw, joints, si: evidence.rate(self.motions, raw, joints, si, 2))
        self._resolve("torque", lambda raw, joints, si: evidence.torque(self.robot, self.motions, raw, joints, si))
        if self._of("torque"):
            torques = self._si("torque")
            self.unsigned = bool(self._of("command")) and has_no_sign(torques, positions)
            self.motions = [
                replace(motion, torque=None if self.unsigned else torque)
                for motion, torque in zip(self.motions, torques, strict=True)
            ]
        self._resolve("current", lambda raw, _, si: evidence.by_size(si, raw, _CURRENT))
        self._resolve("temperature", lambda raw, _, si: _warm(evidence.by_size(si, raw, _WARM)))
        self._resolve("meter_voltage", lambda raw, _, si: evidence.by_size(si, raw, _VOLTAGE))
        self._resolve("meter_current", self._supply_current)
        self._resolve("power", lambda raw, *_: evidence.power(self.robot, self.motions, raw))
        return seconds, started

    def _of(self, field: str) -> list[Meaning]:
        """Return the columns of a channel, base to flange."""
        of_field = [meaning for meaning in self.meanings if meaning.field == field]
        names = self.robot.joint_names
        return sorted(of_field, key=lambda meaning: names.index(meaning.joint) if meaning.joint in names else 0)

    def _values(self, log: Aligned, meaning: Meaning) -> np.ndarray:
        """Return a column on the joint's side of the gear, in its own unit."""
        values = log.columns[meaning.column]
        if not meaning.motor:
            return values
        ratio = self._ratio(meaning)
        return values * ratio if meaning.field == "torque" else values / ratio

    def _ratio(self, meaning: Meaning) -> float:
        ratio = self.told.gear_ratios.get(str(meaning.joint))
        if ratio is None:
            channel = CHANNELS[str(meaning.field)].column(str(meaning.joint))
            unit = meaning.unit or units(self._si_unit(meaning))[0]
            raise DoubtError(
                f"{self.where}: column {meaning.column} is of the motor's side by its name; its gear's ratio is not "
                "known",
                [
                    WayOut("of the motor: the gear's ratio", (("--gear-ratio", f"{meaning.joint}=RATIO"),)),
                    WayOut("of the joint's side", (("--map", f"{meaning.column}={channel}:{unit.name}"),)),
                ],
            )
        return ratio

    def _raw(self, field: str, joints: Sequence[int]) -> list[np.ndarray]:
        """Return a channel of each log, in its own units: (N, joints), or (N,) of the whole robot's."""
        columns = self._of(field)
        if not CHANNELS[field].per_joint:
            return [self._values(log, columns[0]) for log in self.usable]
        return [np.column_stack([self._values(log, columns[joint]) for joint in joints]) for log in self.usable]

    def _si(self, field: str) -> list[np.ndarray]:
        columns = self._of(field)
        return [
            np.column_stack(
                [
                    np.empty((len(log.time), 0)),  # of a meter's log there is nothing else
                    *(self.units[meaning.column][0].to_si(self._values(log, meaning)) for meaning in columns),
                ]
            )
            for log in self.usable
        ]

    def _si_unit(self, meaning: Meaning) -> str:
        kind = "" if meaning.joint is None else self.robot.joints[self.robot.index(meaning.joint)].kind
        return CHANNELS[str(meaning.field)].unit_of(kind)

    def _resolve(self, field: str, look: Look) -> None:
        """Find the unit of each column of a channel; those of one quantity share it where they say none."""
        columns = self._of(field)
        for si in dict.fromkeys(self._si_unit(meaning) for meaning in columns):
            places = [place for place, meaning in enumerate(columns) if self._si_unit(meaning) == si]
            own = [columns[place] for place in places]
            self._share(own, si, lambda places=places, si=si: look(self._raw(field, places), places, si))  # type: ignore[misc]

    def _share(self, columns: Sequence[Meaning], si: str, look: Callable[[], UnitEvidence]) -> None:
        stated = sorted(
            (meaning for meaning in columns if meaning.unit is not None), key=lambda meaning: not meaning.given
        )
        seen = None if stated and stated[0].given else look()
        for meaning in columns:
            if meaning.unit is None and stated:
                assert stated[0].unit is not None  # that is what is said
                self.units[meaning.column] = stated[0].unit, f"as {stated[0].column}"
            elif meaning.unit is None and seen is not None:
                if seen.choice is None:
                    could = seen.allowed if seen.allowed[1:] else units(si)  # one that is not sure is no choice
                    named = " or ".join(unit.name for unit in could)
                    raise self._doubt(meaning, f"could be in {named}: {seen.why}", could)
                self.units[meaning.column] = seen.choice, seen.why
            elif meaning.unit is not None:
                unit = meaning.unit
                if seen is not None and unit not in seen.allowed:
                    question = f"is in {unit.name} {meaning.unit_why}, and cannot be: {seen.why}"
                    raise self._doubt(meaning, question, [*([seen.choice] if seen.choice else seen.allowed), unit])
                self.units[meaning.column] = unit, meaning.unit_why

    def _doubt(self, meaning: Meaning, question: str, choices: Sequence[Unit]) -> DoubtError:
        channel = CHANNELS[str(meaning.field)].column(str(meaning.joint))
        answers = [WayOut(unit.name, (("--map", f"{meaning.column}={channel}:{unit.name}"),)) for unit in choices]
        if meaning.field not in ("q", "time"):
            answers.append(WayOut("leave it out", (("--map", f"{meaning.column}={LEFT_OUT}"),)))
        return DoubtError(
            f"{self.where}: column {meaning.column} ({CHANNELS[str(meaning.field)].label}) {question}", answers
        )

    def _position(self, raw: list[np.ndarray], joints: list[int], _: str) -> UnitEvidence:
        return evidence.position([self.robot.joints[joint] for joint in joints], raw)

    def _supply_current(self, amperes: list[np.ndarray], _: list[int], si: str) -> UnitEvidence:
        if not self._of("meter_voltage"):
            return evidence.by_size(si, amperes, _SUPPLY)
        watts = [volts[:, 0] * ampere for volts, ampere in zip(self._si("meter_voltage"), amperes, strict=True)]
        return evidence.power(self.robot, self.motions, watts, si)

    def _seconds(self, positions: Sequence[np.ndarray]) -> tuple[list[np.ndarray], list[datetime | None]]:
        """Return the times of each log, s, and when it started where its times say that."""
        (column,) = self._of("time")
        if self.usable[0].time.dtype.kind == "M":
            self.units[column.column] = units("s")[0], "from the first date and time on"
            return (
                [(log.time - log.time[0]).astype("int64") / 1e9 for log in self.usable],
                [_moment(int(log.time[0].astype("int64"))) for log in self.usable],
            )
        pairs = [(log.time.astype(float), q) for log, q in zip(self.usable, positions, strict=True)]
        self._share([column], "s", lambda: evidence.time(self.robot, pairs))
        unit = self.units[column.column][0]
        clocks: list[tuple[np.ndarray, datetime | None]] = []
        for log in self.usable:
            first = float(log.time[0]) * unit.factor
            if not _EPOCH[0] <= first < _EPOCH[1]:
                clocks.append((unit.to_si(log.time.astype(float)), None))
                continue
            whole = int(log.time[0]) if log.time.dtype.kind in "iu" else None
            nanoseconds = round(first * 1e9) if whole is None else whole * round(unit.factor * 1e9)
            clocks.append((unit.to_si((log.time - log.time[0]).astype(float)), _moment(nanoseconds)))
        if clocks[0][1] is not None:
            self.units[column.column] = unit, f"{self.units[column.column][1]}; since 1970, s from the first"
        return [time for time, _ in clocks], [started for _, started in clocks]

    def _power_at(self) -> tuple[str | None, str]:
        columns = [meaning for field in OF_POWER for meaning in self._of(field)]
        if not ({"power"} <= {meaning.field for meaning in columns} or len(columns) == 2):
            return None, ""
        if self.told.power_at is not None:
            return self.told.power_at, "as --power-at says"
        if not self.robot.joints:
            return "mains", "as a plant's meters are; nothing says otherwise"
        if is_rtde(self.logs[0].columns):
            return POWER_AT, "RTDE's voltage and current are those of the arm's 48 V"
        words = {word for meaning in columns for word in meaning.words}
        for place, there in (("mains", _MAINS), ("dc_bus", _BUS)):
            if words & there and not words & ((_MAINS | _BUS) - there):
                return place, f"by the name of {columns[0].column}"
        raise DoubtError(
            f"{self.where}: column {columns[0].column}: nothing says whether power was measured at the mains or "
            "on the DC bus",
            [WayOut("at the mains", (("--power-at", "mains"),)), WayOut("on the DC bus", (("--power-at", "dc_bus"),))],
        )

    def _columns(self, log: Aligned, time: np.ndarray) -> dict[str, np.ndarray]:
        columns = {"time": time}
        for field, channel in CHANNELS.items():
            if field == "time":
                continue
            for meaning in self._of(field):
                values = self.units[meaning.column][0].to_si(self._values(log, meaning))
                _check_size(log, meaning.column, values, channel)
                columns[self._channel(meaning)] = values
        return columns

    def _channel(self, meaning: Meaning) -> str:
        unsigned = UNSIGNED if self.unsigned and meaning.field == "torque" else ""
        return CHANNELS[str(meaning.field)].column(f"{unsigned}{meaning.joint}")

    def _row(self, meaning: Meaning) -> Taken:
        if meaning.field is None:
            return Taken(meaning.column, why=meaning.why)
        unit, unit_why = self.units[meaning.column]
        steps = []
        if meaning.motor:
            sign = "x" if meaning.field == "torque" else "/"
            steps.append(f"{sign} {self._ratio(meaning):g} (gear)")
        if unit.factor != 1.0:
            steps.append(f"x {unit.factor:.6g}")
        if unit.offset:
            steps.append(f"{'+' if unit.offset > 0 else '-'} {abs(unit.offset):.6g}")
        name = f"{MOTOR}{unit.name}" if meaning.motor else unit.name
        if self.usable[0].time.dtype.kind == "M" and meaning.field == "time":
            name = "date and time"
        why = meaning.why if unit_why in ("", meaning.why) else f"{meaning.why}; {unit.name} {unit_why}"
        if self.unsigned and meaning.field == "torque":
            why = f"{why}; never below zero: its sign is lacking"
        return Taken(meaning.column, self._channel(meaning), name, " ".join(steps) or "none", why)


def _warm(evidence: UnitEvidence) -> UnitEvidence:
    """Temperatures that could be degC are: degF is taken by name alone."""
    celsius = next((unit for unit in evidence.allowed if unit.name == "degC"), None)
    return UnitEvidence(celsius or evidence.choice, evidence.allowed, evidence.why)


def _check_size(log: Aligned, column: str, values: np.ndarray, channel: Channel) -> None:
    if (greatest := float(np.abs(values).max())) > channel.greatest:
        raise InputError(
            f"{log.recording.path}: column {column} reaches {greatest:.3g} {channel.unit}, which no robot does; "
            f"correct it, or leave it out: --map '{column}={LEFT_OUT}'"
        )


def _moment(nanoseconds: int) -> datetime:
    return datetime.fromtimestamp(0, UTC) + timedelta(microseconds=nanoseconds // 1000)
