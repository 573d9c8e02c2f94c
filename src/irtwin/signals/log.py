"""A data set as handed over: a folder with dataset.toml, a URDF (or a table of joints) and one file a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import UTC, date, datetime, timedelta
from graphlib import CycleError, TopologicalSorter
from pathlib import Path
from typing import Any

from irtwin.errors import InputError
from irtwin.input_file import checksum, real_path
from irtwin.robot.description import FEEDFORWARD, Robot
from irtwin.robot.urdf import read_urdf
from irtwin.signals.channels import Signals
from irtwin.signals.dh_table import robot_of_table
from irtwin.signals.finding import LogFinding
from irtwin.signals.samples import read_signals
from irtwin.signals.sampling import as_sampled, checked_cutoff, holes
from irtwin.signals.sources.bag_source import number_topics
from irtwin.toml_file import TomlTable, read_toml, shown, take

PLANNED = "planned"  # role of a run that holds a motion, of which nothing was measured
ROLES = ("observed", "reference", "simulated", PLANNED)
SHEET_KEYS = ("gear_ratio", "rotor_inertia", "torque_constant", "winding_resistance", "acceleration", "kp", "kd")
POWER_PLACES = ("mains", "dc_bus")
# what the tables of dataset.toml may hold, besides notes
DATA_SET_KEYS = ("robot", "run", "twin", "topics")
ROBOT_KEYS = (
    "name", "urdf", "dh", "manufacturer", "type", "weight", "ambient_temperature", "power_at", "rated_payload",
    "arm_movement_type", "simulated", "torque_scale_uncertainty", "feedforward", "joint", "joints",
)  # fmt: skip
RUN_KEYS = (
    "file", "role", "payload_mass", "payload_com", "repeat_of", "performs", "started", "product", "pieces", "cycles",
)  # fmt: skip
TWIN_KEYS = ("effects", "cutoff")
_MOST_MADE = 10**9
_EARLIEST, _LATEST = 1900, 2200  # years in which a run may have started


@dataclass(frozen=True)
class Run:
    """One motion with its conditions; payload_mass in kg, payload_com in m in the flange frame."""

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
    performs: str | None = None  # name of the planned run that it carried out, here or in the workspace
    time_scaling_of: str | None = None  # name of the measured run that a plan is, made slower
    time_scale: float | None = None  # how many times longer the plan takes
    product: str | None = None  # what it made
    pieces: int | None = None  # how many of them
    cycles: int | None = None  # how often its programme ran

    @property
    def says_effort(self) -> bool:
        """Whether it has torque or power; a run without has commands."""
        return self.signals.torque is not None or self.signals.power is not None


def run_of(name: str, signals: Signals, **known: Any) -> Run:
    """Return an observed run of which nothing is known but its samples, and what is given by the fields' names."""
    nothing: dict[str, Any] = {"file": Path(name), "sha256": "", "role": "observed", "repeat_of": None}
    nothing |= {"payload_mass": 0.0, "payload_com": (0.0, 0.0, 0.0), "started": None, "notes": {}}
    return Run(name=name, signals=signals, **(nothing | known))


@dataclass(frozen=True)
class DataSet:
    """A robot and its runs; `effects` is what the twin is said to model, None for the baseline.

    `plans` are the runs whose role is "planned": motions alone, which no twin is fitted to and no diagnosis reads.
    `repairs` says what was done in reading: bad samples dropped, joints that mimic others left out; `findings` what
    was mended: a run cut at a hole in time, held samples thinned out.
    """

    folder: Path
    robot: Robot
    runs: tuple[Run, ...]
    effects: tuple[str, ...] | None = None
    ambient_temperature: float | None = None  # degC
    power_at: str | None = None
    simulated: bool = False
    notes: Mapping[str, Any] = field(default_factory=dict)
    repairs: tuple[str, ...] = ()
    findings: tuple[LogFinding, ...] = ()
    urdf: Path | None = None  # the file that describes the robot, beside which its meshes lie
    plans: tuple[Run, ...] = ()
    torque_scale_uncertainty: float | None = None  # share by which logged torque may be off, 95 %
    cutoff: float | None = None  # Hz, of the filter that all runs pass; None: it is to be found
    sha256: Mapping[Path, str] = field(default_factory=dict)  # of `dataset.toml` and the URDF, as they were read

    @property
    def is_commanded(self) -> bool:
        """Whether no run has torque or power, so that its commands are all there is."""
        return not any(run.says_effort for run in self.runs)


def read_data_set(folder: Path | str, *, repair: bool = False, commanded: bool = False) -> DataSet:
    """Read and check a data set; `repair` drops bad samples; `commanded`: runs with commands need no torque or power.

    A run NAME with holes in time becomes several, NAME, NAME.2 and so on. Raises InputError, naming file, line or
    column, on whatever is wrong.
    """
    folder = Path(folder)
    file = folder / "dataset.toml"
    document = _document(file)
    table = TomlTable(file, "[robot]", take(document, "robot", dict, file, "[robot]"))
    robot = _robot(folder, table)
    repairs = [f"{file}: {_held(robot)}"] if robot.held else []
    repairs += [
        f"{file}: [robot] {key} is kept as a note; did you mean {near}?" for key, near in table.near_misses(ROBOT_KEYS)
    ]
    findings: list[LogFinding] = []
    topics = _topics(file, document, robot)
    read: list[Run] = []
    for number, values in enumerate(take(document, "run", list, file, "[[run]]"), start=1):
        listing = TomlTable(file, f"[[run]] {number}", values if isinstance(values, dict) else {})
        pieces, notes, faults = _pieces(folder, listing, robot, repair, commanded, topics)
        read, repairs, findings = read + pieces, repairs + notes, findings + faults
    listed = _resolved(read, file)
    runs = tuple(run for run in listed if run.role != PLANNED)
    if not runs:
        raise InputError(f"{file}: every run is planned; a twin needs one that was measured")
    power_at = table.choice("power_at", POWER_PLACES)
    TomlTable(file, "", document).check_keys(DATA_SET_KEYS)
    urdf = table.path("urdf", folder) if "urdf" in table.values else None
    twin = _optional(file, document, "twin", TWIN_KEYS)
    effects = twin.values.get("effects")
    if effects is not None and not (isinstance(effects, list) and all(isinstance(e, str) for e in effects)):
        raise InputError(f"{file}: [twin] effects should be a list of effect ids")
    return DataSet(
        folder=folder,
        robot=robot,
        runs=runs,
        effects=None if effects is None else tuple(effects),
        ambient_temperature=table.number("ambient_temperature"),
        power_at=power_at,
        simulated=table.values.get("simulated") is True or all(run.role == "simulated" for run in runs),
        notes={key: value for key, value in table.values.items() if key not in ("joint", "joints", "urdf", "dh")},
        repairs=tuple(dict.fromkeys(repairs)),
        findings=tuple(findings),
        urdf=urdf,
        plans=tuple(run for run in listed if run.role == PLANNED),
        torque_scale_uncertainty=_torque_scale(table),
        sha256={path: checksum(path) for path in (file, urdf) if path is not None},
        cutoff=_cutoff(twin, runs),
    )


def read_log(
    file: Path,
    robot: Robot,
    *,
    payload_mass: float = 0.0,
    payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0),
    performs: str | None = None,
    repair: bool = False,
) -> DataSet:
    """Read a log alone, as a data set of one observed run, or of several where it has holes in time.

    payload_mass in kg, payload_com in m in the flange frame. Raises InputError as `read_data_set` does.
    """
    signals, dropped = read_signals(file, robot, repair=repair)
    pieces, sampled = as_sampled(signals, file, robot.joint_names)
    known = {"payload_mass": payload_mass, "payload_com": payload_com, "performs": performs}
    run = run_of(file.stem, signals, file=file, sha256=checksum(file), **known)
    return DataSet(
        folder=file.parent,
        robot=robot,
        runs=tuple(_piece(run, number, piece) for number, piece in enumerate(pieces, start=1)),
        repairs=tuple(dropped),
        findings=tuple(sampled),
    )


def check_plan(signals: Signals, file: Path) -> None:
    """Raise InputError where a planned motion has a hole in time: nothing says how the robot is to pass it."""
    gaps = holes(signals.time)
    if len(gaps):
        raise InputError(f"{file}: has a hole in time after {signals.time[gaps[0] - 1]:.12g} s; plan the motion whole")


def own_runs(runs: Sequence[Run]) -> list[Run]:
    """Return the runs that a robot's twin is of: a simulator's stay apart where the robot's own are there."""
    return [run for run in runs if run.role != "simulated"] or list(runs)


def _held(robot: Robot) -> str:
    single = len(robot.held) == 1
    phrase = "joint {} mimics another: it is" if single else "joints {} mimic others: they are"
    return f"{phrase.format(', '.join(robot.held))} held at zero, and left out of the logs"


def payload_told(file: Path) -> tuple[float, tuple[float, float, float]]:
    """Return a run's payload, kg and m in the flange frame, by the data set around it; none where none lists the file.

    Raises InputError where that data set's dataset.toml cannot be read.
    """
    for _, table in _listing(file):
        return table.number("payload_mass", least=0.0) or 0.0, _centre(table)
    return 0.0, (0.0, 0.0, 0.0)


def _document(file: Path) -> dict[str, Any]:
    folder, real = real_path(file.parent), real_path(file)
    if folder is not None and folder.is_file():
        given = f"LOG --robot {file.parent}" if folder.suffix.lower() == ".urdf" else f"{file.parent} --robot ROBOT"
        raise InputError(
            f"{file.parent}: is a file; a data set is a folder: `irtwin import {given} --out FOLDER` makes one of a log"
        )
    if folder is not None and not folder.exists():
        raise InputError(f"{file.parent}: there is no such file or folder; name a data set")
    if real is None or not real.exists():
        if real is not None and any(real.parent.glob(f"*/{file.name}")):
            raise InputError(
                f"{file.parent}: holds data sets, and is none itself; name one, or take all by --out RESULTS"
            )
        raise InputError(
            f"{file}: not found; a data set is a folder with dataset.toml, a URDF and runs/: "
            "`irtwin import LOG ... --robot ROBOT --out FOLDER` makes one of logs"
        )
    return read_toml(file)


def topics_told(file: Path, robot: Robot) -> dict[str, str]:
    """Return what [topics] of the data set around a run says; nothing where none lists the file. Raises InputError."""
    for document, table in _listing(file):
        return _topics(table.file, document, robot)
    return {}


def _listing(file: Path) -> Iterator[tuple[dict[str, Any], TomlTable]]:
    """Yield the data sets around a run that list it, each with the run's table."""
    for folder in list(file.absolute().parents)[:2]:
        toml = folder / "dataset.toml"
        document = read_toml(toml) if toml.is_file() else {}
        runs = document.get("run")
        for number, values in enumerate(runs if isinstance(runs, list) else [], start=1):
            table = TomlTable(toml, f"[[run]] {number}", values if isinstance(values, dict) else {})
            named = table.text("file")
            if named is not None and real_path(folder / named) == real_path(file):
                yield document, table


def read_robot(source: Path) -> Robot:
    """Read a robot from a URDF file, a data set's folder or its dataset.toml; runs are not read. Raises InputError."""
    file = source / "dataset.toml" if source.is_dir() else source
    if file.suffix != ".toml":
        return read_urdf(file)
    return _robot(file.parent, TomlTable(file, "[robot]", take(_document(file), "robot", dict, file, "[robot]")))


def _robot(folder: Path, table: TomlTable) -> Robot:
    name = table.needed("name")
    if "joints" in table.values:
        return _metered(name, table)
    if "dh" in table.values and "urdf" in table.values:
        raise InputError(f"{table.file}: [robot] has both urdf and dh; keep the one that describes the robot")
    if "dh" not in table.values and "urdf" not in table.values:
        raise InputError(
            f"{table.file}: [robot] urdf is missing; name the URDF, or describe the joints in [robot.dh]; of a meter's "
            "log write joints = []"
        )
    robot = robot_of_table(name, table) if "dh" in table.values else read_urdf(table.path("urdf", folder))
    sheets = table.values.get("joint", {})
    if not isinstance(sheets, dict):
        raise InputError(f"{table.file}: [robot.joint.NAME] should be a table for each joint")
    for joint in sheets:
        if joint not in robot.joint_names:
            raise InputError(
                f'{table.file}: [robot.joint.{joint}]: the robot has no moving joint "{joint}" '
                f"(it has {', '.join(robot.joint_names)})"
            )
    joints = []
    for joint in robot.joints:
        values = sheets.get(joint.name, {})
        if not isinstance(values, dict):
            raise InputError(f"{table.file}: [robot.joint.{joint.name}] should be a table")
        sheet = TomlTable(table.file, f"[robot.joint.{joint.name}]", values)
        sheet.check_keys(SHEET_KEYS)
        given: dict[str, Any] = {key: sheet.number(key, least=0.0) for key in SHEET_KEYS}
        joints.append(replace(joint, **given))
    return replace(
        robot,
        name=name,
        joints=tuple(joints),
        manufacturer=table.text("manufacturer"),
        type=table.text("type"),
        weight=table.number("weight", least=0.0),
        feedforward=table.choice("feedforward", FEEDFORWARD),
    )


def _metered(name: str, table: TomlTable) -> Robot:
    """Return a robot of which a meter's power is all that was logged. Raises InputError where joints are said too."""
    given = [key for key in ("urdf", "dh", "joint") if key in table.values]
    if table.values["joints"] != [] or given:
        wrong = f"and {given[0]}" if given else f"= {shown(table.values['joints'])}"
        raise InputError(
            f"{table.file}: [robot] joints {wrong}: joints = [] alone says that no joint was logged, of a meter; "
            "else describe the robot by urdf or dh"
        )
    return Robot(
        name, (), (), "", manufacturer=table.text("manufacturer"), type=table.text("type"),
        weight=table.number("weight", least=0.0),
    )  # fmt: skip


def _pieces(
    folder: Path, table: TomlTable, robot: Robot, repair: bool, commanded: bool, topics: Mapping[str, str]
) -> tuple[list[Run], list[str], list[LogFinding]]:
    """Return the run of a table, in pieces where it has holes in time; what was done in reading; what was mended."""
    table.check_notes(RUN_KEYS)
    path = table.path("file", folder)
    role = table.choice("role", ROLES, "observed")
    planned = role == PLANNED
    signals, notes = read_signals(path, robot, repair=repair, measured=not planned, commanded=commanded, topics=topics)
    if planned:
        signals = signals.motion
        check_plan(signals, path)
    pieces, faults = as_sampled(signals, path, () if planned else robot.joint_names)
    run = Run(
        name=path.stem,
        file=path,
        sha256=checksum(path),
        role=role,
        payload_mass=table.number("payload_mass", least=0.0) or 0.0,
        payload_com=_centre(table),
        repeat_of=table.text("repeat_of"),
        performs=table.text("performs"),
        started=None if planned else _started(table),
        notes={key: value for key, value in table.values.items() if key not in ("file", "role")},
        signals=signals,
        **_made(table, role),
    )
    if len(pieces) > 1 and (run.pieces or run.cycles):
        run = replace(run, pieces=None, cycles=None)
        notes.append(
            f"{table.file}: {table.name} pieces and cycles are left out: the run is cut at holes in time, and nothing "
            "says what was made in which part"
        )
    return [_piece(run, number, piece) for number, piece in enumerate(pieces, start=1)], notes, faults


def _made(table: TomlTable, role: str) -> dict[str, Any]:
    """Return what a run made. Raises InputError where a number is none of whole things, or the run is a plan."""
    made: dict[str, Any] = {"product": table.text("product")}
    for key in ("pieces", "cycles"):
        count = table.values.get(key)
        if count is not None and (
            isinstance(count, bool) or not isinstance(count, int) or not 1 <= count <= _MOST_MADE
        ):
            raise table.fault(key, f"should be a whole number of 1 or more, not {shown(count)}")
        made[key] = count
    given = [key for key, value in made.items() if value is not None]
    if given and role == PLANNED:
        raise InputError(f"{table.file}: {table.name} is planned; {given[0]} is of a run that was carried out")
    return made


def _torque_scale(table: TomlTable) -> float | None:
    share = table.number("torque_scale_uncertainty", least=0.0)
    if share is not None and share >= 1:
        raise table.fault("torque_scale_uncertainty", f"should be a share below 1, not {share:g}; 0.1 is 10 %")
    return share


def _topics(file: Path, document: Mapping[str, Any], robot: Robot) -> dict[str, str]:
    """Return what [topics] says: the topic of the joint states, and of columns that these do not carry."""
    table = _optional(file, document, "topics", ("joint_states", *number_topics(robot)))
    return {key: table.text(key) or "" for key in table.values}


def _optional(file: Path, document: Mapping[str, Any], name: str, keys: Sequence[str]) -> TomlTable:
    values = document.get(name, {})
    if not isinstance(values, dict):
        raise InputError(f"{file}: [{name}] should be a table")
    table = TomlTable(file, f"[{name}]", values)
    table.check_keys(keys)
    return table


def _cutoff(table: TomlTable, runs: Sequence[Run]) -> float | None:
    cutoff = table.number("cutoff")
    where = f"{table.file}: {table.name} cutoff"
    return None if cutoff is None else checked_cutoff(cutoff, [run.signals for run in runs], where)


def _piece(run: Run, number: int, signals: Signals) -> Run:
    """Return a run of some of its samples, named by its number from the second on; it started when they do."""
    later = float(signals.time[0] - run.signals.time[0])
    return replace(
        run,
        name=run.name if number == 1 else f"{run.name}.{number}",
        started=run.started and run.started + timedelta(seconds=later),
        signals=signals,
    )


def _centre(table: TomlTable) -> tuple[float, float, float]:
    x, y, z = table.numbers("payload_com", 3, "three numbers in m") or (0.0, 0.0, 0.0)
    return x, y, z


def _started(table: TomlTable) -> datetime | None:
    value = table.values.get("started")
    if value is None:
        return None
    if isinstance(value, date) and not isinstance(value, datetime):
        value = datetime(value.year, value.month, value.day)
    if not isinstance(value, datetime):
        raise table.fault("started", f"should be a TOML date and time, not {shown(value)}")
    if not _EARLIEST <= value.year <= _LATEST:
        raise table.fault("started", f"must be in the years {_EARLIEST} to {_LATEST}, not {value}")
    return value if value.tzinfo else value.replace(tzinfo=UTC)


def _resolved(runs: list[Run], file: Path) -> tuple[Run, ...]:
    """Check that names are unique and let `repeat_of` name a run instead of its file."""
    names: dict[str, Path] = {}
    for run in runs:
        if run.name in names:
            raise InputError(f'{file}: two runs are named "{run.name}" ({names[run.name]}, {run.file}); rename one')
        names[run.name] = run.file
    files = {real_path(run.file): run.name for run in reversed(runs)}  # of a run in pieces, the first
    plans = {run.name for run in runs if run.role == PLANNED}
    resolved = []
    for run in runs:
        if run.repeat_of is not None:
            target = files.get(real_path(file.parent / run.repeat_of))
            if target is None or target == run.name:
                raise InputError(
                    f'{file}: run "{run.name}" repeat_of = "{run.repeat_of}" is not another run of this data set'
                )
            run = replace(run, repeat_of=target)
        if run.role == PLANNED and (run.repeat_of is not None or run.performs is not None):
            raise InputError(f'{file}: run "{run.name}" is planned; repeat_of and performs are of measured runs')
        if run.repeat_of in plans:
            raise InputError(
                f'{file}: run "{run.name}" repeat_of = "{run.repeat_of}" is a planned run; write performs = '
                f'"{run.repeat_of}"'
            )
        if run.performs in names and run.performs not in plans:
            raise InputError(f'{file}: run "{run.name}" performs = "{run.performs}", which is not a planned run')
        resolved.append(run)
    _check_circles({run.name: run.repeat_of for run in resolved}, file)
    return tuple(resolved)


def _check_circles(repeats: Mapping[str, str | None], file: Path) -> None:
    try:
        TopologicalSorter({name: [of] for name, of in repeats.items() if of is not None}).prepare()
    except CycleError as error:
        raise InputError(
            f"{file}: runs {' and '.join(error.args[1][1:])} repeat each other in a circle; remove repeat_of from the "
            "first one"
        ) from error
