"""The jobs: logs of others into a new data set, and an empty data set to fill in."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet

from irtwin.bring import rtde_names
from irtwin.bring.data_set_text import RunText, data_set_text
from irtwin.bring.doubt import DoubtError, WayOut
from irtwin.bring.metered import with_power
from irtwin.bring.recording import Recording, read_recording
from irtwin.bring.robot_library import robot_of, with_fixed
from irtwin.bring.taken import LogsAlike, TakenRun
from irtwin.bring.told import UserSaid, roles, told
from irtwin.check.check import check
from irtwin.check.plausibility import urdf_finding
from irtwin.errors import InputError
from irtwin.robot.description import Robot
from irtwin.robot.ros_names import free_name
from irtwin.signals.log import DataSet, read_data_set
from irtwin.signals.sampling import interval
from irtwin.storage.files import working_folder

Ask = Callable[[DoubtError], WayOut]
_PREFIX = ".irtwin-import-"
_TOPIC = re.compile(r'say which in dataset\.toml: \[topics\] (\S+) = "(.*)"$')


@dataclass(frozen=True)
class Options:
    """What the user says: `maps`, `gear_ratios`, `topics`, `fixed`, `roles` as they are typed, payload in kg and m.

    `names`: of the columns of logs that have no line of names.
    """

    name: str | None = None
    maps: tuple[str, ...] = ()
    gear_ratios: tuple[str, ...] = ()
    topics: tuple[str, ...] = ()
    fixed: tuple[str, ...] = ()
    names: tuple[str, ...] = ()
    roles: tuple[str, ...] = ()
    power_at: str | None = None
    payload_mass: float | None = None
    payload_com: tuple[float, float, float] = (0.0, 0.0, 0.0)
    repair: bool = False

    def with_answer(self, answer: WayOut) -> Options:
        """Return them with an answer, as if it had been typed."""
        given: dict[str, list[str]] = {"--map": [*self.maps], "--gear-ratio": [*self.gear_ratios], "--power-at": []}
        for option, value in answer.options:
            given[option].append(value)
        maps, ratios, places = (tuple(values) for values in given.values())
        return replace(self, maps=maps, gear_ratios=ratios, power_at=places[-1] if places else self.power_at)


def bring(
    files: Sequence[Path], out: Path, robot: str | None, options: Options, ask: Ask | None = None
) -> list[LogsAlike]:
    """Write logs as a new data set, a run a file; return what was brought, those of the same columns together.

    `robot`: a URDF file, a data set, or a name; None: a meter's logs, of whose joints nothing is known. `ask` answers
    what cannot be told; DoubtError where it is None. Raises InputError where a log cannot be used; nothing is written
    then.
    """
    _check_place(out)
    described, origin = (_metered(files), "") if robot is None else robot_of(robot)
    if robot is not None:
        described = with_fixed(described, options.fixed)
        if (wrong := urdf_finding(described)) is not None:
            raise InputError(f"{robot}: {wrong.say}")
    role, topics = roles(files, options.roles), dict(_topic(text) for text in options.topics)
    logs = [_read(file, described, topics) for file in files]
    logs = [log.named(options.names) for log in logs] if options.names else logs
    logs = [with_power(log) for log in logs] if robot is None else logs
    user_said, forms, power_at = _settled(logs, described, options, ask)
    name = options.name or described.name
    runs: dict[Path, tuple[RunText, TakenRun]] = {}
    for form in forms:
        for recording, run in zip(form.logs, form.runs, strict=True):
            text = _run_text(recording, run, _name(recording.path, runs), form, options)
            runs[recording.path] = replace(text, role=role[recording.path]), run
    listed = [runs[file] for file in dict.fromkeys(files)]
    written = data_set_text(
        described, name, [run for run, _ in listed], origin=origin, power_at=power_at[0], power_at_why=power_at[1],
        gear_ratios=dict(user_said.gear_ratios),
    )  # fmt: skip
    _write(out, described, written, {text.file: pa.table(dict(run.columns)) for text, run in listed})
    return forms


def import_logs(
    files: Sequence[Path | str], out: Path | str, robot: Path | str | None = None, **options: Any
) -> DataSet:
    """Bring logs in other formats into a new data set, a run a file, and return it.

    robot: a URDF file, a data set, or a robot's name; None: logs of a meter. options: fields of `Options`, such as
    `power_at="mains"` or `maps=("pos_*=q:deg",)`. Raises InputError where a log cannot be used or a column's meaning
    cannot be told, with what to say; nothing is written then.
    """
    bring([Path(file) for file in files], Path(out), None if robot is None else str(robot), Options(**options))
    return read_data_set(out)


def init(out: Path, robot: str | None, name: str | None) -> None:
    """Write an empty data set to fill in. Raises InputError where the folder is not empty."""
    _check_place(out)
    described, origin = (None, "put it beside this file") if robot is None else robot_of(robot)
    text = data_set_text(described, name or (described.name if described else "NAME"), (), origin=origin)
    _write(out, described, text, {})


def _metered(files: Sequence[Path]) -> Robot:
    """Return the robot of a meter's logs, named by the first until somebody names it."""
    return Robot(re.sub(r"[^\w\-]+", "_", files[0].stem).strip("_") or "meter", (), (), "")


_Settled = tuple[UserSaid, list[LogsAlike], tuple[str | None, str]]


def _settled(logs: Sequence[Recording], robot: Robot, options: Options, ask: Ask | None) -> _Settled:
    """Return what the user says and answers, logs by form, and where power was measured.

    Where nobody answers, one line asks for all that is asked whatever the answers.
    """
    while True:
        try:
            return _formed(logs, robot, options)
        except DoubtError as doubt:
            if ask is not None:
                options = options.with_answer(ask(doubt))
                continue
            first, last = (_questions(logs, robot, options, which) for which in (0, -1))
            asked = [text for text in first if text in last]
            raise doubt if len(asked) == 1 else InputError("; and ".join(asked)) from None


def _questions(logs: Sequence[Recording], robot: Robot, options: Options, which: int) -> list[str]:
    """Return all that is asked where each question gets its first answer, or its last."""
    asked: list[str] = []
    while True:
        try:
            _formed(logs, robot, options)
        except DoubtError as doubt:
            if str(doubt) not in asked and doubt.answers:
                asked.append(str(doubt))
                options = options.with_answer(doubt.answers[which])
                continue
        except InputError:  # it may come of an answer that nobody gave
            pass
        return asked


def _formed(logs: Sequence[Recording], robot: Robot, options: Options) -> _Settled:
    user_said = told(options.maps, options.gear_ratios, options.power_at, robot)
    user_said.check(name for log in logs for name in log.names)
    forms = [LogsAlike(group, robot, user_said, options.repair) for group in _of_one_form(logs)]
    return user_said, forms, _one_place(forms)


def _of_one_form(logs: Sequence[Recording]) -> list[list[Recording]]:
    groups: dict[tuple[object, ...], list[Recording]] = {}
    for log in logs:
        times = tuple(name for name, values in log.columns.items() if values.dtype.kind == "M")
        groups.setdefault((log.names, log.texts, times, tuple(log.units.items()), log.is_bag), []).append(log)
    return list(groups.values())


def _one_place(forms: Sequence[LogsAlike]) -> tuple[str | None, str]:
    places = {form.power_at: form.power_at_why for form in forms if form.power_at is not None}
    if len(places) > 1:
        files = " and ".join(f"{form.logs[0].path} ({form.power_at})" for form in forms if form.power_at)
        raise InputError(f"power was measured at two places: {files}; make two data sets, or give --power-at")
    return next(iter(places.items()), (None, ""))


def _read(file: Path, robot: Robot, topics: Mapping[str, str]) -> Recording:
    try:
        return read_recording(file, robot, topics)
    except InputError as error:
        raise InputError(_TOPIC.sub(r"give --topic \1=\2", str(error))) from error


def _topic(text: str) -> tuple[str, str]:
    column, sign, topic = text.partition("=")
    if not sign or not topic:
        raise InputError(f"--topic {text}: give COLUMN=TOPIC, as joint_states=/arm/joint_states")
    return column, topic


def _run_text(log: Recording, run: TakenRun, name: str, form: LogsAlike, options: Options) -> RunText:
    time = run.columns["time"]
    lasts = f"{len(time)} samples, {time[-1] - time[0]:.4g} s at {1 / interval(time):.4g} Hz"
    load = rtde_names.payload(log) if rtde_names.is_rtde(log.columns) else None
    why = "what the controller was told, by RTDE"
    if options.payload_mass is not None:
        load, why = (options.payload_mass, options.payload_com), "as --payload-mass says"
    text = RunText(
        f"runs/{name}.parquet",
        f"from {log.path.name} ({log.form}): {lasts}",
        started=run.started,
        columns=form.columns if log is form.logs[0] else (),
    )
    return text if load is None else replace(text, payload_mass=load[0], payload_com=load[1], payload_why=why)


def _name(path: Path, taken: Mapping[Path, tuple[RunText, TakenRun]]) -> str:
    name = re.sub(r"[^\w\-]+", "_", path.stem).strip("_") or "run"
    return free_name(name, [Path(text.file).stem for text, _ in taken.values()])


def found_in(folder: Path) -> tuple[tuple[str, ...], str | None]:
    """Return what reading and checking say of a data set that was written, and the command that uses it as it is.

    None where something must be cured first.
    """
    try:
        data_set = read_data_set(folder, commanded=True)
    except InputError as error:
        return (f"to do: {error}",), None
    lines = [f"note: {line}" for line in data_set.repairs]
    checked = check(data_set)
    for finding in checked.findings:
        state = "cure first" if finding.stops else "mended when it is read" if finding.mended else "to be looked at"
        lines.append(f"{finding.fault} ({state}): {finding.say}")
    beside = any(run.role == "simulated" for run in data_set.runs)
    command = f"irtwin diagnose {folder}" if beside or data_set.is_commanded else f"irtwin run {folder}"
    command += " --simulator MODEL.xml" if data_set.is_commanded else ""
    return tuple(dict.fromkeys(lines)), command if checked.sound else None


def _check_place(out: Path) -> None:
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is a file; name a new folder for the data set")
    if out.is_dir() and any(out.iterdir()):
        raise InputError(f"{out}: is not empty; name a new folder for the data set")


def _write(out: Path, robot: Robot | None, text: str, runs: Mapping[str, pa.Table]) -> None:
    """Write a data set, whole or not at all; `runs`: by their files in it."""
    try:
        out.absolute().parent.mkdir(parents=True, exist_ok=True)
        with working_folder(out.absolute().parent, _PREFIX) as folder:
            made = folder / "data_set"
            (made / "runs").mkdir(parents=True)
            if robot is not None and robot.urdf:
                (made / "robot.urdf").write_text(robot.urdf, encoding="utf-8")
            for file, table in runs.items():
                pa.parquet.write_table(table, made / file)
            (made / "dataset.toml").write_text(text, encoding="utf-8")
            made.replace(out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror}); choose another place") from error
