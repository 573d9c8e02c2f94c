"""A data set as handed over: a folder with dataset.toml, a URDF and one file a run."""

from __future__ import annotations

import hashlib
import math
import tomllib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, timedelta
from pathlib import Path
from typing import Any

from irtwin.errors import InputError
from irtwin.input_file import read_input
from irtwin.robot.description import Robot
from irtwin.robot.urdf import read_urdf
from irtwin.signals.samples import Signals, read_signals
from irtwin.signals.sampling import as_sampled

ROLES = ("observed", "reference", "simulated")
_LARGEST = 20_000_000  # bytes of dataset.toml
_GREATEST = 1e300  # of a number
_SHEET = ("gear_ratio", "rotor_inertia", "torque_constant", "winding_resistance", "acceleration")
_POWER_AT = ("mains", "dc_bus")
_EARLIEST, _LATEST = 1900, 2200  # years in which a run may have started


@dataclass(frozen=True)
class Run:
    """One recorded motion with its conditions; payload_mass in kg, payload_com in m in the flange frame."""

    name: str
    file: Path
    sha256: str
    role: str
    payload_mass: float
    payload_com: tuple[float, float, float]
    repeat_of: str | None  # name of a run
    started: datetime | None
    notes: Mapping[str, Any]
    signals: Signals = field(repr=False)


@dataclass(frozen=True)
class DataSet:
    """A robot and its runs; `effects` is what the twin is said to model, None for the baseline.

    `repairs` says what was done to the samples: some dropped, a run cut at a hole in time, held samples thinned out.
    """

    folder: Path
    robot: Robot
    runs: tuple[Run, ...]
    effects: tuple[str, ...] | None
    ambient_temperature: float | None  # degC
    power_at: str
    simulated: bool
    notes: Mapping[str, Any]
    repairs: tuple[str, ...] = ()


def read_data_set(folder: Path, *, repair: bool = False) -> DataSet:
    """Read and check a data set; `repair` drops bad samples.

    A run NAME with holes in time becomes several, NAME, NAME.2 and so on. Raises InputError, naming file, line or
    column, on whatever is wrong.
    """
    file = folder / "dataset.toml"
    document = _read_toml(file)
    table = _Table(file, "[robot]", _take(document, "robot", dict, file, "[robot]"))
    robot = _robot(folder, table)
    repairs: list[str] = []
    runs = list(_runs(folder, file, document, robot, repair, repairs))
    power_at = table.text("power_at", "mains")
    if power_at not in _POWER_AT:
        raise InputError(f'{file}: [robot] power_at = "{power_at}"; use {" or ".join(_POWER_AT)}')
    twin = document.get("twin", {})
    effects = twin.get("effects") if isinstance(twin, dict) else None
    if effects is not None and not (isinstance(effects, list) and all(isinstance(e, str) for e in effects)):
        raise InputError(f"{file}: [twin] effects should be a list of effect ids")
    return DataSet(
        folder=folder,
        robot=robot,
        runs=_resolved(runs, file),
        effects=None if effects is None else tuple(effects),
        ambient_temperature=table.number("ambient_temperature"),
        power_at=power_at,
        simulated=table.values.get("simulated") is True or all(run.role == "simulated" for run in runs),
        notes={key: value for key, value in table.values.items() if key not in ("joint", "urdf")},
        repairs=tuple(repairs),
    )


def payload_told(file: Path) -> tuple[float, tuple[float, float, float]]:
    """Return a run's payload, kg and m in the flange frame, by the data set around it; none where none lists the file.

    Raises InputError where that data set's dataset.toml cannot be read.
    """
    for folder in list(file.absolute().parents)[:2]:
        toml = folder / "dataset.toml"
        runs = _read_toml(toml).get("run") if toml.is_file() else None
        for number, values in enumerate(runs if isinstance(runs, list) else [], start=1):
            table = _Table(toml, f"[[run]] {number}", values if isinstance(values, dict) else {})
            named = table.text("file")
            if named is not None and _real(folder / named) == _real(file):
                return table.number("payload_mass", least=0.0) or 0.0, _centre(table)
    return 0.0, (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class _Table:
    """A TOML table whose faults name it."""

    file: Path
    name: str
    values: dict[str, Any]

    def text(self, key: str, default: str | None = None) -> str | None:
        value = self.values.get(key, default)
        if value is not None and not (isinstance(value, str) and value.strip()):
            raise InputError(f"{self.file}: {self.name} {key} should be text, not {_shown(value)}")
        return value

    def number(self, key: str, *, least: float = -math.inf) -> float | None:
        value = self.values.get(key)
        if value is None:
            return None
        if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or value < least:
            bound = "" if least == -math.inf else f" of at least {least:g}"
            raise InputError(f"{self.file}: {self.name} {key} should be a number{bound}, not {_shown(value)}")
        return float(value)

    def path(self, key: str, folder: Path) -> Path:
        text = self.text(key)
        if text is None:
            raise InputError(f"{self.file}: {self.name} {key} is missing")
        path = folder / text
        real = _real(path)
        if real is None:
            raise InputError(f'{self.file}: {self.name} {key} = "{text[:200]}" is no path that can be followed')
        if not real.is_relative_to(folder.resolve()):
            raise InputError(
                f'{self.file}: {self.name} {key} = "{text}" leads out of the data set; copy the file into it'
            )
        if not real.is_file():
            raise InputError(f'{self.file}: {self.name} {key} = "{text}": there is no such file')
        return path


def _real(path: Path) -> Path | None:
    """Return where a path leads; None where its links go round in a circle or a name is too long."""
    try:
        real = path.resolve()
        real.is_file()
        return real
    except (OSError, RuntimeError):  # Python 3.13 has the former for a circle, those before the latter
        return None


def _read_toml(file: Path) -> dict[str, Any]:
    if not file.exists():
        raise InputError(f"{file}: not found; a data set is a folder with dataset.toml, a URDF and runs/")
    content = read_input(file, _LARGEST)
    try:
        document = tomllib.loads(content.decode())
    except ValueError as error:  # an integer of thousands of digits is no TOMLDecodeError
        raise InputError(f"{file}: not valid TOML: {error}") from error
    except RecursionError as error:
        raise InputError(f"{file}: not valid TOML: nested too deeply") from error
    _check_values(document, file, "")
    return document


def _check_values(value: Any, file: Path, name: str) -> None:
    """Raise on numbers beyond a float and on null characters, which neither paths nor databases take."""
    if isinstance(value, int) and not -_GREATEST <= value <= _GREATEST:
        raise InputError(f"{file}: {name} is a number beyond {_GREATEST:g}")
    if isinstance(value, str) and "\0" in value:
        raise InputError(f"{file}: {name} has a null character in it")
    if isinstance(value, dict):
        for key, inner in value.items():
            _check_values(key, file, f"a key of {name}")
            _check_values(inner, file, f"{name}.{key}".removeprefix("."))
    if isinstance(value, list):
        for inner in value:
            _check_values(inner, file, name)


def _shown(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 60 else f"{text[:60]}..."


def _take(document: dict[str, Any], key: str, kind: type, file: Path, name: str) -> Any:
    value = document.get(key)
    if not isinstance(value, kind) or not value:
        raise InputError(f"{file}: {name} is missing")
    return value


def _robot(folder: Path, table: _Table) -> Robot:
    name = table.text("name")
    if name is None:
        raise InputError(f"{table.file}: [robot] name is missing")
    robot = read_urdf(table.path("urdf", folder))
    sheets = table.values.get("joint", {})
    if not isinstance(sheets, dict):
        raise InputError(f"{table.file}: [robot.joint.NAME] should be a table for each joint")
    for joint in sheets:
        if joint not in robot.joint_names:
            raise InputError(
                f'{table.file}: [robot.joint.{joint}]: the URDF has no moving joint "{joint}" '
                f"(it has {', '.join(robot.joint_names)})"
            )
    joints = []
    for joint in robot.joints:
        values = sheets.get(joint.name, {})
        if not isinstance(values, dict):
            raise InputError(f"{table.file}: [robot.joint.{joint.name}] should be a table")
        sheet = _Table(table.file, f"[robot.joint.{joint.name}]", values)
        given: dict[str, Any] = {key: sheet.number(key, least=0.0) for key in _SHEET}
        joints.append(replace(joint, **given))
    return replace(
        robot,
        name=name,
        joints=tuple(joints),
        manufacturer=table.text("manufacturer"),
        type=table.text("type"),
        weight=table.number("weight", least=0.0),
    )


def _runs(
    folder: Path, file: Path, document: dict[str, Any], robot: Robot, repair: bool, repairs: list[str]
) -> Iterator[Run]:
    for number, values in enumerate(_take(document, "run", list, file, "[[run]]"), start=1):
        table = _Table(file, f"[[run]] {number}", values if isinstance(values, dict) else {})
        path = table.path("file", folder)
        role = table.text("role", "observed") or ""
        if role not in ROLES:
            raise InputError(f'{file}: {table.name} role = "{role}"; use {", ".join(ROLES)}')
        signals, dropped = read_signals(path, robot, repair=repair)
        pieces, sampled = as_sampled(signals, path)
        repairs += dropped + sampled
        run = Run(
            name=path.stem,
            file=path,
            sha256=hashlib.sha256(path.read_bytes()).hexdigest(),
            role=role,
            payload_mass=table.number("payload_mass", least=0.0) or 0.0,
            payload_com=_centre(table),
            repeat_of=table.text("repeat_of"),
            started=_started(table),
            notes={key: value for key, value in table.values.items() if key not in ("file", "role")},
            signals=signals,
        )
        yield from (_piece(run, number, piece) for number, piece in enumerate(pieces, start=1))


def _piece(run: Run, number: int, signals: Signals) -> Run:
    """Return a run of some of its samples, named by its number from the second on; it started when they do."""
    later = float(signals.time[0] - run.signals.time[0])
    return replace(
        run,
        name=run.name if number == 1 else f"{run.name}.{number}",
        started=run.started and run.started + timedelta(seconds=later),
        signals=signals,
    )


def _centre(table: _Table) -> tuple[float, float, float]:
    value = table.values.get("payload_com", [0.0, 0.0, 0.0])
    if not (isinstance(value, list) and len(value) == 3):
        raise InputError(f"{table.file}: {table.name} payload_com should be three numbers in m")
    x, y, z = (_Table(table.file, f"{table.name} payload_com", {"part": part}).number("part") or 0.0 for part in value)
    return x, y, z


def _started(table: _Table) -> datetime | None:
    value = table.values.get("started")
    if value is None:
        return None
    if isinstance(value, date) and not isinstance(value, datetime):
        value = datetime(value.year, value.month, value.day)
    if not isinstance(value, datetime):
        raise InputError(f"{table.file}: {table.name} started should be a TOML date and time, not {_shown(value)}")
    if not _EARLIEST <= value.year <= _LATEST:
        raise InputError(f"{table.file}: {table.name} started lies in no year from {_EARLIEST} to {_LATEST}: {value}")
    return value if value.tzinfo else value.replace(tzinfo=UTC)


def _resolved(runs: list[Run], file: Path) -> tuple[Run, ...]:
    """Check that names are unique and let `repeat_of` name a run instead of its file."""
    names: dict[str, Path] = {}
    for run in runs:
        if run.name in names:
            raise InputError(f'{file}: two runs are named "{run.name}" ({names[run.name]}, {run.file}); rename one')
        names[run.name] = run.file
    files = {run.file.resolve(): run.name for run in reversed(runs)}  # of a run in pieces, the first
    resolved = []
    for run in runs:
        if run.repeat_of is not None:
            target = files.get((file.parent / run.repeat_of).resolve())
            if target is None or target == run.name:
                raise InputError(
                    f'{file}: run "{run.name}" repeat_of = "{run.repeat_of}" is no other run of this data set'
                )
            run = replace(run, repeat_of=target)
        resolved.append(run)
    _check_circles({run.name: run.repeat_of for run in resolved}, file)
    return tuple(resolved)


def _check_circles(repeats: Mapping[str, str | None], file: Path) -> None:
    for name in repeats:
        seen: list[str] = []
        at: str | None = name
        while at is not None and at not in seen:
            seen.append(at)
            at = repeats[at]
        if at is not None:
            raise InputError(f"{file}: runs {' and '.join(seen)} repeat each other in a circle; one of them came first")
