"""The physics as a library: from a data set to a twin and what it predicts, without a workspace."""

from __future__ import annotations

import io
import json
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from xml.etree import ElementTree

import pyarrow as pa
import pyarrow.parquet

from irtwin.announce import Announce
from irtwin.check.check import Checked, check, checked
from irtwin.effects.effect import Effect
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.choice import identified
from irtwin.identification.cutoff import cutoff_for
from irtwin.planning import robot_program
from irtwin.planning.admission import check_motion
from irtwin.planning.plan import Plan, Task, nominal_twin
from irtwin.planning.plan import plan as make_plan
from irtwin.robot.collision import CollisionModel
from irtwin.robot.description import Robot
from irtwin.robot.urdf import read_urdf
from irtwin.signals.channels import Signals, columns_of, csv_text
from irtwin.signals.conditioning import condition
from irtwin.signals.log import DataSet, Run, own_runs, read_data_set
from irtwin.signals.motion import Motion
from irtwin.signals.sampling import as_sampled
from irtwin.storage.files import check_new, check_place, write
from irtwin.twin import predict as predicted
from irtwin.twin.described import places, text_of
from irtwin.twin.doubts import doubts
from irtwin.twin.files import load
from irtwin.twin.identify import identify as fit
from irtwin.twin.price import Price, price
from irtwin.twin.torque_scale import torque_scale
from irtwin.twin.twin import Twin


def identify(data_set: Path | str | DataSet, effects: Sequence[str | Effect] | None = None) -> Twin:
    """Fit a twin to the runs of a data set, all filtered alike.

    effects: ids of the catalogue, or effects of a shape; None takes those of `dataset.toml`, else those that the runs
    show: the twin's `choices`. A simulator's runs stay apart where the robot's own are there. Weighted least squares on
    the base regressor, with bounds (M. Gautier, "Dynamic identification of robots with power model", ICRA 1997).
    Raises InputError on bad input, or where there is nothing to fit.

    >>> import irtwin
    >>> twin = irtwin.identify(demo)
    >>> len(twin.robot.joints), round(twin.condition_number) < 200
    (6, True)
    >>> friction = next(one for one in twin.stated if one.effect == "coulomb_friction")
    >>> friction.joint, friction.unit, friction.lower < friction.value < friction.upper
    ('joint_a1', 'N m', True)
    """
    given = checked(data_set if isinstance(data_set, DataSet) else read_data_set(Path(data_set))).data_set
    own = own_runs(given.runs)
    cutoff = cutoff_for(given.robot, own, given.cutoff)
    motions = [condition(run, given.robot, cutoff.hz) for run in own]
    named = given.effects if effects is None else effects
    twin = (
        identified(replace(given, runs=tuple(own), cutoff=cutoff.hz), motions)
        if named is None
        else fit(given.robot, motions, named)
    )
    return replace(twin, torque_scale=torque_scale(given, motions, twin.joint_torque))


def predict(
    twin: Path | str | Twin,
    run_file: Path | str,
    out: Path | str | None = None,
    *,
    payload_mass: float | None = None,
    payload_com: tuple[float, float, float] | None = None,
) -> pa.Table:
    """Return what a twin expects of a run's motion, a row a sample: `time` s, `tau_J` N m of each joint, `power` W.

    twin: one that was identified, or the file of a saved one; `out`: a Parquet file to write it to. payload_mass kg,
    payload_com m in the flange frame: what the controller was told; None takes it from the data set that lists the run.
    Raises InputError on a file that is no twin or no run of its robot, or on a motion that the robot cannot make: one
    that leaves its limits, or in which two links meet.

    >>> import irtwin
    >>> twin = irtwin.identify(demo)
    >>> table = irtwin.predict(twin, demo / "runs" / "exciting_1.parquet")
    >>> table.column_names[:2], table.column_names[-1]
    (['time', 'tau_joint_a1'], 'power')
    """
    return expect(twin, run_file, out, payload_mass=payload_mass, payload_com=payload_com).table


def check_log(folder: Path | str, *, repair: bool = False, json_file: Path | str | None = None) -> Checked:
    """Read a data set and check its logs; write what was found. Raises InputError on what cannot be read."""
    if json_file is not None:
        check_place(Path(json_file))
    result = check(read_data_set(folder, repair=repair, commanded=True))
    if json_file is not None:
        document = {"findings": [finding.to_json() for finding in result.findings]}
        write(Path(json_file), (json.dumps(document, indent=1, ensure_ascii=False, allow_nan=False) + "\n").encode())
    return result


def read_sound(folder: Path, repair: bool, announce: Announce, commanded: bool = False) -> DataSet:
    """Read a data set and check it; say what was dropped, found and mended. Raises InputError on what must be cured."""
    data_set = read_data_set(folder, repair=repair, commanded=commanded)
    try:
        Stack(data_set.robot, data_set.effects or ())
    except InputError as error:
        raise InputError(f"{data_set.folder / 'dataset.toml'}: [twin] effects: {error}") from error
    return sound(data_set, announce)


def sound(data_set: DataSet, announce: Announce) -> DataSet:
    """Return a data set, mended where that leaves no doubt; say what was. Raises InputError on what must be cured."""
    for line in data_set.repairs:
        announce(f"  {line}")
    check_result = checked(data_set)
    lines = tuple(dict.fromkeys(finding.say for finding in check_result.findings))
    for line in lines:
        announce(f"  {line}")
    return replace(check_result.data_set, repairs=(*data_set.repairs, *lines))


def clocked(announce: Announce) -> Announce:
    """Put the seconds since now before each line."""
    began = time.monotonic()
    return lambda line: announce(f"{time.monotonic() - began:5.1f} s  {line}")


@dataclass(frozen=True)
class Expectation:
    """What a twin expects of a motion: a row a sample, and its price, None where the twin knows nothing of power.

    checks_itself: whether the robot has shapes that were held to keep off one another. run: the motion as it was read.
    """

    run: Run
    table: pa.Table
    price: Price | None
    checks_itself: bool


def expect(
    twin: Path | str | Twin,
    run_file: Path | str,
    out: Path | str | None = None,
    *,
    payload_mass: float | None = None,
    payload_com: tuple[float, float, float] | None = None,
) -> Expectation:
    """Return what `predict` does, and what the motion costs.

    Arguments and errors are those of `predict`.
    """
    if out is not None:
        check_place(Path(out))
    known = twin if isinstance(twin, Twin) else load(Path(twin))
    run = predicted.read_motion(known, Path(run_file), payload_mass, payload_com)
    table = predicted.predict(known, run)
    motions = _motions(known, run)
    collisions = CollisionModel(known.robot)
    for motion in motions:
        check_motion(known, motion, collisions, run.file)
    cost = price(known, motions)
    expected = Expectation(run, table, cost, collisions.checks_itself)
    if out is not None:
        write_table(expected.table, Path(out))
    return expected


def motions_of(robot: Robot, file: Path) -> list[Motion]:
    """Return the motions, one between holes each, of a run's file. Raises InputError on a file that is no run."""
    known = nominal_twin(robot)
    return _motions(known, predicted.read_motion(known, file))


def _motions(twin: Twin, run: Run) -> list[Motion]:
    pieces, _ = as_sampled(run.signals, run.file)
    return [condition(replace(run, signals=piece), twin.robot, twin.cutoff) for piece in pieces]


def write_model(twin: Twin, form: str, out: Path) -> list[str]:
    """Write a twin's robot as "urdf", "mjcf", "sdf" or "usd"; return lines on what that holds, and does not.

    Raises InputError where there is no place to write, or a file, or a body of the twin is not consistent.
    """
    check_new(out)
    if form == "usd" and out.suffix not in (".usda", ".usd"):  # readers go by it
        raise InputError(f"{out}: USD is written as text; name the file {out.stem}.usda")
    write(out, text_of(twin, form).encode())
    held = [f"{effect} ({place})" for effect, place in places(twin, form) if place]
    lacking = [effect for effect, place in places(twin, form) if not place]
    words = [*doubts(twin), f"{form.upper()} has {', '.join(held) or 'nothing'} of the twin"]
    words += [f"{form.upper()} has no place for {', '.join(lacking)}"] if lacking else []
    return words


def write_faulty_model(twin: Twin, joint: str, out: Path) -> None:
    """Write a twin's robot for MuJoCo, where the rotor of one joint has half its inertia: a fault to be found."""
    check_place(out)
    model = ElementTree.fromstring(text_of(twin, "mjcf"))
    element = next(candidate for candidate in model.iter("joint") if candidate.get("name") == joint)
    element.set("armature", repr(float(element.attrib["armature"]) / 2))
    write(out, ElementTree.tostring(model))


def read_twin(source: Path) -> Twin:
    """Return a saved twin; of a URDF, or a data set's folder, one that knows its robot's sheet alone."""
    if source.suffix == ".json":
        return load(source)
    return nominal_twin(read_data_set(source).robot if source.is_dir() else read_urdf(source))


def plan(source: Path | str | Twin, task: Task, out: Path | str | None = None, rate: float = 100.0) -> Plan:
    """Plan a motion, and write it by its ending: as a log, which `predict` takes, or as a program.

    source: a twin or its file, a URDF, or the folder of a data set. Raises InputError as `planning.plan.plan` does.
    """
    if out is not None:
        check_plan_file(Path(out))
    planned = make_plan(source if isinstance(source, Twin) else read_twin(Path(source)), task, rate)
    if out is not None:
        write_motion(planned.motion, planned.robot, Path(out))
    return planned


def check_plan_file(out: Path) -> None:
    """Raise InputError where no plan can be written to a file of this name."""
    check_place(out)
    if out.suffix.lower() not in (".csv", ".parquet", *robot_program.WRITERS):
        raise InputError(f"{out}: a motion is written as .csv, .parquet, .script or .src; name such a file")


def write_motion(motion: Motion, robot: Robot, out: Path) -> None:
    """Write a planned motion by its ending: as a log, CSV or Parquet, or as a program, URScript or KRL.

    Raises InputError where a program's language has no place for the robot.
    """
    ending, joints = out.suffix.lower(), robot.joint_names
    if program := robot_program.WRITERS.get(ending):
        write(out, program(motion, robot, out.stem).encode())
        return
    signals = Signals(motion.time, motion.q, dq=motion.dq, ddq=motion.ddq)
    if ending == ".csv":
        write(out, csv_text(signals, joints).encode())
        return
    write_table(pa.table(columns_of(signals, joints)), out)


def write_table(table: pa.Table, out: Path) -> None:
    """Write a table, such as that of an expectation, as Parquet."""
    buffer = io.BytesIO()
    pa.parquet.write_table(table, buffer)
    write(out, buffer.getvalue())
