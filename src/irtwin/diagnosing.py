"""A diagnosis, end to end: a data set is read and judged; what is found is kept in a workspace, and written into files.

A simulator's model is played beside it, if no more is asked than how far it is from the robot.

Graph, database and pages are imported where a workspace or a report is asked for: a diagnosis alone is physics.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.gap import diagnosis as gap
from irtwin.gap.diagnosis import Diagnosis
from irtwin.identification.progress import telling
from irtwin.location import Location
from irtwin.modelling import clocked, read_sound
from irtwin.proposed_motion import save_motion
from irtwin.resources import resources_of
from irtwin.signals.log import DataSet
from irtwin.signals.sampling import checked_cutoff
from irtwin.simulator.differences import bodies_beside, drawn, written
from irtwin.simulator.model import Model, read_model, with_simulated_runs
from irtwin.simulator.played_log import PlayedLog, play_log
from irtwin.simulator.playing import Playing
from irtwin.simulator.playing import diagnose as diagnose_by_playing
from irtwin.simulator.servos import has_servos
from irtwin.simulator.sysid import script
from irtwin.simulator.trusted import Trusted, trusted
from irtwin.storage.files import check_new, check_place, write
from irtwin.twin.doubts import doubts
from irtwin.twin.files import load, to_json
from irtwin.twin.twin import Twin


def diagnose(
    dataset: Path | str,
    *,
    twin: Twin | Path | str | None = None,
    simulator: Path | str | None = None,
    joints: Sequence[str] = (),
    withhold: Sequence[str] = (),
    trust: Sequence[str] = (),
    held_out: Sequence[str] = (),
    cutoff: float | None = None,
    seed: int = 0,
    repair: bool = False,
    workspace: Location | Path | str | None = None,
    json_file: Path | str | None = None,
    report: Path | str | None = None,
    twin_file: Path | str | None = None,
    motion_file: Path | str | None = None,
    sysid_file: Path | str | None = None,
    simulator_file: Path | str | None = None,
    draws: int = 0,
    announce: Announce = lambda line: None,
) -> Diagnosis | Playing:
    """Diagnose the gap between a robot's twin, or its simulator, and its runs.

    `twin`, or the file of one, is what the gap is held against, in place of what the data set says of it: its effects
    in their shapes, and its numbers as the prior. `simulator` is the file of a model, MJCF, URDF, SDF or USD: what it
    says of the observed motions is held against the robot, as runs of a simulator are, its `joints` named in the
    robot's order where it calls them otherwise; commands of runs are played through its servos (channel "position"),
    and their torque is held against them. Runs that are `held_out`, by name, take no part in that fit, and the tracking
    error is told of them alone. `withhold` takes effects out of the twin and leaves them in the catalogue;
    `trust`, families or ids of effects, are right: no cause is looked for among them.
    `cutoff`, Hz, is the filter's, in place of what the data set says. With a `workspace` the diagnosis is kept there,
    in the graph too, so that `adopt` can make its twin the robot's. Files to write, each whole or not at all:
    `json_file` the diagnosis, `report` an HTML page, `twin_file` the twin with the causes added, `motion_file` the
    motion of the next experiment, where one is designed, `sysid_file` a Python script that fits what differs by
    `mujoco.sysid`, `simulator_file` the simulator's model with the numbers that the robot has, and beside it as many
    `draws` of what these could be, FILE-1 and so on.
    The `document` of what is returned says the same, typed. Raises InputError on bad input, before anything is written.
    """
    announce = clocked(announce)
    location = None if workspace is None else Location.of(workspace)
    files = _Files.checked(json_file, report, twin_file, motion_file, sysid_file, simulator_file, draws=draws)
    files.check_apart(Path(source) for source in (simulator, twin) if isinstance(source, Path | str))
    if location is not None or files.report is not None:
        from irtwin.report.extensions import check

        check(resources_of(None if location is None else location.folder))
    given, right = load(Path(twin)) if isinstance(twin, Path | str) else twin, trusted(trust)
    announce("Reading the data set")
    data_set = read_sound(Path(dataset), repair, announce, commanded=simulator is not None)
    files.check_apart([*data_set.sha256, *(run.file for run in (*data_set.runs, *data_set.plans))])
    model = None if simulator is None else read_model(Path(simulator), data_set.robot, joints)
    if model is not None:
        _take_in(model, files, announce)
    lacking = {"a twin": twin, "a twin's file": twin_file, "a motion": motion_file, "a cutoff": cutoff}
    asked = _asked(data_set, lacking | {"an effect to withhold": withhold or None})
    if sysid_file is not None:
        _check_playable(data_set, model, asked, "a script for mujoco.sysid fits what is played")
        if data_set.robot.feedforward:
            raise InputError(f"{sysid_file}: the script plays no feedforward, which [robot] tells of the controller")
    if held_out:
        if sysid_file is not None:
            raise InputError(f"{sysid_file}: the script fits all runs; hold none out for it")
        _check_playable(data_set, model, asked, "runs are held out where logs are played")
    data_set = _with_cutoff(data_set, cutoff)
    if location is not None:
        from irtwin.workflow import as_asserted

        data_set = as_asserted(location, data_set)
    with telling(announce):
        diagnosis: Diagnosis | Playing | None = (
            None if asked or model is None else _played(data_set, model, right, held_out)
        )
        if diagnosis is None:
            data_set = data_set if model is None else with_simulated_runs(data_set, model)
            diagnosis = gap.diagnose(
                data_set, twin=given, simulator=model, withhold=withhold, unknown=right.effects, seed=seed
            )
    if location is not None:  # first, as a damaged workspace is to leave no file beside its error
        from irtwin.workflow import keep_diagnosis

        keep_diagnosis(location, data_set, diagnosis, announce)
    files.write(data_set, diagnosis, model, location, seed, announce)
    return diagnosis


def play(
    dataset: Path | str,
    simulator: Path | str,
    *,
    joints: Sequence[str] = (),
    repair: bool = False,
    json_file: Path | str | None = None,
    announce: Announce = lambda line: None,
) -> PlayedLog:
    """Play the commands of a robot's runs through a model, MJCF, URDF, SDF or USD, as it is: how far is it off?

    `joints` as of `diagnose`; `json_file`: where to write what is returned. Nothing is fitted, and no cause is sought.
    Raises InputError on bad input, before anything is written.
    """
    announce, files = clocked(announce), _Files.checked(json_file, draws=0)
    data_set = read_sound(Path(dataset), repair, announce, commanded=True)
    files.check_apart([Path(simulator), *data_set.sha256, *(run.file for run in data_set.runs)])
    model = read_model(Path(simulator), data_set.robot, joints)
    _take_in(model, files, announce)
    with telling(announce):
        played = play_log(data_set, model)
    if files.json is not None:
        write(files.json, _json(played.to_json()))
    return played


def _json(told: object) -> bytes:
    return (json.dumps(told, indent=1, allow_nan=False) + "\n").encode()


@dataclass(frozen=True)
class _Files:
    """Where what is found is to be written."""

    json: Path | None
    report: Path | None = None
    twin: Path | None = None
    motion: Path | None = None
    sysid: Path | None = None
    simulator: Path | None = None
    draws: tuple[Path, ...] = field(kw_only=True)

    @classmethod
    def checked(cls, *files: Path | str | None, draws: int) -> _Files:
        """Take files as they are asked for. Raises InputError where one cannot be written."""
        places = [None if file is None else Path(file) for file in files]
        last = places[-1] if draws else None
        more = () if last is None else tuple(last.with_stem(f"{last.stem}-{number + 1}") for number in range(draws))
        for file in (*filter(None, places), *more):
            check_place(file)
        return cls(*places, draws=more)

    def check_apart(self, read: Iterable[Path]) -> None:
        """Raise InputError where a file to write is one that is read, under whatever name."""
        own = {path.resolve(): path for path in read}
        named = (self.json, self.report, self.twin, self.motion, self.sysid, self.simulator, *self.draws)
        for file in filter(None, named):
            if file.resolve() in own:
                raise InputError(f"{file}: is what the diagnosis is made of, and stays as it is; name another file")

    def write(
        self,
        data_set: DataSet,
        diagnosis: Diagnosis | Playing,
        model: Model | None,
        location: Location | None,
        seed: int,
        announce: Announce,
    ) -> None:
        """Write the files that are asked for."""
        if model and self.simulator:
            announce(f"Writing {self.simulator}")
            for file, content in zip((self.simulator, *self.draws), _models(diagnosis, model, seed), strict=False):
                write(file, content)
            for line in _said_of_written(self.simulator, diagnosis, model):
                announce(f"  {line}")
        if self.sysid is not None:
            _write_script(data_set, diagnosis, self.sysid, announce)
        if self.json is not None:
            write(self.json, _json(diagnosis.document.to_json()))
        if self.twin is not None and diagnosis.twin is not None:
            for doubt in doubts(diagnosis.twin):
                announce(f"  {doubt}")
            announce(f"Writing {self.twin}")
            write(self.twin, to_json(diagnosis.twin).encode())
        if self.motion is not None and isinstance(diagnosis, Diagnosis):
            announce(f"  {save_motion(diagnosis, self.motion)}")
        if self.report is not None:
            from irtwin.report.gap.page import render_alone

            announce(f"Writing the report {self.report}")
            resources = resources_of(None if location is None else location.folder)
            render_alone(data_set, diagnosis.document, diagnosis.curves, self.report, resources)


def _said_of_written(file: Path, diagnosis: Diagnosis | Playing, model: Model) -> Iterator[str]:
    if isinstance(diagnosis, Playing):
        if lacking := diagnosis.unwritten:
            yield f"{file} has no place for {', '.join(lacking)}: these stay as they are"
        if diagnosis.in_file is not diagnosis.chosen:
            yield f"{file} has no place for a soft joint: it has the others of its numbers that come nearest"
    elif (beside := bodies_beside(model, diagnosis.document, diagnosis.twin)) is not None:
        if beside.written:
            yield f"{file} has all bodies{' and rotors' if beside.rotors else ''} of the twin with the causes"
        else:
            yield f"{file} cannot be given other bodies: these and the rotors stay as they are; write them in by hand"


def _take_in(model: Model, files: _Files, announce: Announce) -> None:
    """Say what of a model is not the robot's. Raises InputError where it cannot be written to files, if to any."""
    if model.others:
        announce(f"  {model.file.path}: joints that the robot lacks are told nothing: {', '.join(model.others)}")
    if files.simulator is not None:
        model.file.check_written(files.simulator)
        for file in (files.simulator, *files.draws):
            check_new(file)


def _write_script(data_set: DataSet, diagnosis: Diagnosis | Playing, file: Path, announce: Announce) -> None:
    if isinstance(diagnosis, Playing) and diagnosis.in_file.differs.any():
        write(file, script(diagnosis.in_file, diagnosis.document, data_set.folder, file))
    else:
        announce(f"  no number of the servos differs: there is nothing for {file} to fit")


def _models(diagnosis: Diagnosis | Playing, model: Model, seed: int) -> Iterator[bytes]:
    """Yield the model's file with the robot's numbers, then, without end, with these as they could be."""
    rng = np.random.default_rng(seed)
    yield diagnosis.written() if isinstance(diagnosis, Playing) else written(model, diagnosis.document, diagnosis.twin)
    while True:
        yield (
            diagnosis.drawn(rng)
            if isinstance(diagnosis, Playing)
            else drawn(model, diagnosis.document, diagnosis.twin, rng)
        )


def _with_cutoff(data_set: DataSet, cutoff: float | None) -> DataSet:
    """Return the data set with a cutoff, Hz, in place of its own, if one is given. Raises InputError by `cutoff`."""
    if cutoff is None:
        return data_set
    signals = [run.signals for run in data_set.runs]
    return replace(data_set, cutoff=checked_cutoff(cutoff, signals, "cutoff"))


def _asked(data_set: DataSet, lacking: Mapping[str, object]) -> bool:
    """Return whether anything is given or asked for that a diagnosis by playing lacks.

    Raises InputError where there is no other.
    """
    asked = [name for name, value in lacking.items() if value is not None]
    if asked and data_set.is_commanded:
        raise InputError(
            f"{data_set.folder}: has commands and no torque: {asked[0]} is of no use for it; leave that out"
        )
    return bool(asked)


def _played(data_set: DataSet, model: Model, right: Trusted, held_out: Sequence[str]) -> Playing | None:
    """Return the diagnosis by playing; None where what the model lacks is to be looked for in the torque."""
    if not data_set.is_commanded and not _can_play(data_set, model):
        return None
    played = diagnose_by_playing(data_set, model, right, held_out)
    return None if played.is_open and not held_out else played


def _check_playable(data_set: DataSet, model: Model | None, asked: bool, why: str) -> None:
    """Raise InputError where nothing is played."""
    if asked or model is None or not (data_set.is_commanded or _can_play(data_set, model)):
        raise InputError(
            f"{data_set.folder}: {why}: this needs commands (cmd_JOINT) in all "
            "runs, and a simulator's model with position servos, or the gains of its controller (kp, kd)"
        )


def _can_play(data_set: DataSet, model: Model) -> bool:
    """Return whether all runs are the robot's own and have commands, and the model's joints are driven by them."""
    return has_servos(model) and all(
        run.role == "observed" and run.signals.command is not None for run in data_set.runs
    )
