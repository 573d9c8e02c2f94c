"""Between the physics' objects and the database's rows: what is taken in, and how it is given back."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from sqlalchemy import select

from irtwin.announce import Announce
from irtwin.errors import InputError, WorkspaceFault
from irtwin.json_text import parse_json
from irtwin.planning.admission import check_motion
from irtwin.providers.mesh_files import MeshCopy, mesh_copies
from irtwin.providers.names import check_run_name, find_run, identifier, run_iri
from irtwin.providers.structure_rows import device_rows, structure_rows
from irtwin.robot import description
from irtwin.robot.collision import CollisionModel
from irtwin.robot.urdf import parse_urdf
from irtwin.signals import log
from irtwin.signals.channels import columns_of, from_columns
from irtwin.signals.conditioning import condition
from irtwin.storage.asserted import AssertedFact, follow
from irtwin.storage.database import Outcome, Workspace
from irtwin.storage.files import inside
from irtwin.storage.schema import (
    MEASURED,
    MEASURED_RUN,
    MODELLED,
    PLANNED,
    PLANNED_RUN,
    WATCHED_RUNS,
    Base,
    JointRow,
    RobotNote,
    RobotRow,
    RunRow,
    Series,
    SourceFile,
    TwinRow,
    in_utc,
)
from irtwin.twin.files import from_json
from irtwin.twin.twin import Twin

# Of a joint: its limits and data sheet, by the columns that hold them; a limit that is infinite has no value there.
_LIMITS = {
    "lower": "lower_limit_rad", "upper": "upper_limit_rad", "velocity": "speed_limit_rad_s",
    "effort": "torque_limit_nm",
}  # fmt: skip
_SHEET = {
    "acceleration": "acceleration_limit_rad_s2", "gear_ratio": "gear_ratio", "rotor_inertia": "rotor_inertia_kg_m2",
    "torque_constant": "torque_constant_nm_a", "winding_resistance": "winding_resistance_ohm",
}  # fmt: skip
_HAVE_TERMS = {*log.ROBOT_KEYS} - {"torque_scale_uncertainty"}  # keys of [robot] that are no notes in the graph


def ingest(
    workspace: Workspace,
    data_set: log.DataSet,
    announce: Announce = lambda line: None,
    facts: Sequence[AssertedFact] = (),
) -> Outcome:
    """Take a data set into the workspace, all of it or nothing; say whether it was new.

    `facts` are what users asserted of the robot, which is followed. `announce` is told of that, and of each mesh that
    cannot be drawn.
    """
    meshes, undrawn = mesh_copies(data_set)
    for line in undrawn:
        announce(line)
    robot, parts, runs = rows_of(data_set, meshes)
    for line in follow([robot, *parts, *runs], facts):
        announce(line)
    _check_kept_runs(workspace, robot.robot_id, data_set, runs)
    series = {
        row.run_id: pa.table(columns_of(run.signals, data_set.robot.joint_names))
        for row, run in zip(runs, _listed(data_set), strict=True)
    }
    documents = {mesh.path: mesh.content for mesh in meshes.values()}
    return workspace.ingest(robot, parts, runs, series, documents, facts)


def followed(data_set: log.DataSet, facts: Sequence[AssertedFact]) -> log.DataSet:
    """Return a data set as users asserted that it is: its robot's joints and sheet, its payloads and temperature."""
    if not facts:
        return data_set
    row, parts, runs = rows_of(data_set, {})
    follow([row, *parts, *runs], facts)
    payloads = {row.name: row.payload_kg for row in runs}
    return replace(
        data_set,
        robot=_with_sheets(data_set.robot, row, {part.name: part for part in parts if isinstance(part, JointRow)}),
        runs=tuple(replace(run, payload_mass=payloads[run.name]) for run in data_set.runs),
        plans=tuple(replace(run, payload_mass=payloads[run.name]) for run in data_set.plans),
        ambient_temperature=row.ambient_temperature_degc,
    )


def rows_of(data_set: log.DataSet, meshes: Mapping[str, MeshCopy]) -> tuple[RobotRow, list[Base], list[RunRow]]:
    """Return the rows of what a data set says: the robot, its parts, and each run; `meshes` by their names.

    Raises InputError where two runs are one by their names.
    """
    robot_id = identifier(data_set.robot.name)
    now = datetime.now(UTC)
    runs = [_run_row(robot_id, run, now, data_set.folder) for run in _listed(data_set)]
    if len({row.run_id for row in runs}) < len(runs):
        raise InputError(f"{data_set.folder}: two runs have the same name in two forms of Unicode; rename one")
    parts: list[Base] = [
        *_source_files(robot_id, data_set),
        *(
            RobotNote(robot_id=robot_id, name=name, number=number, text=text)
            for name, values in flat_notes(data_set.notes).items()
            if name not in _HAVE_TERMS
            for number, text in enumerate(values, start=1)
        ),
        *(_joint_row(robot_id, place, joint) for place, joint in enumerate(data_set.robot.joints, start=1)),
        *structure_rows(robot_id, data_set.robot, meshes),
        *device_rows(robot_id, data_set),
    ]
    return _robot_row(robot_id, data_set), parts, runs


def _listed(data_set: log.DataSet) -> list[log.Run]:
    return [*data_set.runs, *data_set.plans]


def keep_run(workspace: Workspace, robot_id: str, joint_names: Sequence[str], run: log.Run) -> str:
    """Keep a run of no data set, planned or measured; return its run_id.

    Raises InputError where its name is taken, or it carried out what is no plan of the robot.
    """
    check_run_name(workspace, robot_id, run.name)
    row = _run_row(robot_id, run, datetime.now(UTC))
    row.role = None
    if run.performs is not None:
        find_run(workspace, robot_id, run.performs, PLANNED_RUN)
    workspace.keep_run(row, pa.table(columns_of(run.signals, joint_names)))
    return row.run_id


def _check_kept_runs(workspace: Workspace, robot_id: str, data_set: log.DataSet, runs: Sequence[RunRow]) -> None:
    """Raise InputError where a data set does not go with the runs of no data set that the workspace keeps."""
    kept = workspace.all(select(RunRow).where(RunRow.robot_id == robot_id, RunRow.role.is_(None)))
    joints = joint_names(workspace, robot_id)
    plans = {row.run_id: row.name for row in kept if row.kind == PLANNED_RUN}
    toml = data_set.folder / "dataset.toml"
    if any(row.kind not in WATCHED_RUNS for row in kept) and joints != data_set.robot.joint_names:
        raise InputError(
            f"{toml}: the workspace keeps runs of this robot with the joints {', '.join(joints)}; remove the robot "
            "with `irtwin workspace drop` first, or give it another name"
        )
    taken = {row.run_id for row in kept}
    own = {row.run_id for row in runs if row.kind == PLANNED_RUN}
    for row in runs:
        if row.run_id in taken:
            raise InputError(f'{toml}: the workspace keeps a run "{row.name}" of this robot already; rename the file')
        if row.performs is not None and row.performs not in own | set(plans):
            name = row.performs.removeprefix(f"{robot_id}.")
            raise InputError(
                f'{toml}: run "{row.name}" performs = "{name}", which is no planned run, here or in {workspace.folder}'
            )


def inputs(workspace: Workspace, robot_id: str, run_ids: Iterable[str]) -> list[str]:
    """Return the IRIs, below the base, of what is read of some runs: they, their samples, files that say of what."""
    ids = list(run_ids)
    told = select(Series.series_id, Series.run_id)
    told = told.where(Series.run_id.in_(ids), Series.kind != MODELLED)
    files = select(SourceFile.source_file_id).where(SourceFile.robot_id == robot_id)
    with workspace.reading() as session:
        series = [f"series/{series_id}/{run_id}" for series_id, run_id in session.execute(told)]
        return [*map(run_iri, ids), *series, *(f"source_file/{file_id}" for file_id in session.scalars(files))]


def stored_data_set(workspace: Workspace, robot_id: str, robot: description.Robot) -> log.DataSet:
    """Return what the data set of a robot said, but for its runs."""
    row = workspace.row(RobotRow, robot_id)
    notes = parse_json(row.notes)
    return log.DataSet(
        folder=Path(robot_id),
        robot=robot,
        runs=(),
        effects=None if row.twin_effects is None else tuple(row.twin_effects.split(",")),
        ambient_temperature=row.ambient_temperature_degc,
        power_at=row.power_measured_at,
        simulated=row.simulated,
        notes=notes,
        torque_scale_uncertainty=notes.get("torque_scale_uncertainty"),
        cutoff=row.cutoff_hz,
    )


def is_described(workspace: Workspace, robot_id: str) -> bool:
    """Whether a robot's joints are known; they are not where a meter alone was logged."""
    return bool(workspace.row(RobotRow, robot_id).urdf)


def joint_names(workspace: Workspace, robot_id: str) -> tuple[str, ...]:
    """Return the names of a robot's joints, base to flange."""
    in_order = select(JointRow.name).where(JointRow.robot_id == robot_id).order_by(JointRow.position)
    return tuple(workspace.all(in_order))


def load_robot(workspace: Workspace, robot_id: str) -> description.Robot:
    """Give back a robot with its data sheet. Raises WorkspaceFault where a joint of its URDF has no row."""
    with workspace.reading() as session:
        row = session.get_one(RobotRow, robot_id)
        sheets = {joint.name: joint for joint in session.scalars(select(JointRow).where(JointRow.robot_id == robot_id))}
    if not row.urdf:
        raise InputError(
            f'{workspace.folder}: of "{row.name}" a meter alone was logged; this needs its joints: bring a log of '
            "their positions with its URDF"
        )
    bare = parse_urdf(row.urdf, source=f"URDF of {row.name}")
    if lost := [name for name in bare.joint_names if name not in sheets]:
        raise WorkspaceFault(
            f'{workspace.folder}: the database has no row of joint "{lost[0]}" of "{row.name}"; run its data set '
            "again, or restore a backup by `irtwin workspace restore ARCHIVE --workspace NEW`"
        )
    return _with_sheets(replace(bare, name=row.name), row, sheets)


def _with_sheets(robot: description.Robot, row: RobotRow, sheets: Mapping[str, JointRow]) -> description.Robot:
    """Return a robot with the limits and data sheets that rows say."""

    def stated(sheet: JointRow) -> dict[str, Any]:
        none = dict.fromkeys(_LIMITS, math.inf) | {"lower": -math.inf}
        values = {name: getattr(sheet, column) for name, column in (_LIMITS | _SHEET).items()}
        return {name: none.get(name) if value is None else value for name, value in values.items()}

    joints = tuple(replace(joint, **stated(sheets[joint.name])) for joint in robot.joints)
    return replace(robot, joints=joints, manufacturer=row.manufacturer, type=row.type, weight=row.weight_kg)


def load_run(workspace: Workspace, robot: description.Robot, run_id: str) -> log.Run:
    """Give back a run with its signals, measured or planned."""
    row = workspace.row(RunRow, run_id)
    planned = row.kind == PLANNED_RUN
    samples = workspace.read_series(run_id, PLANNED if planned else MEASURED)
    columns = {name: np.array(samples.column(name)) for name in samples.column_names}
    return log.Run(
        name=row.name,
        file=Path(row.file),
        sha256=row.sha256,
        role=row.role or (log.PLANNED if planned else "observed"),
        payload_mass=row.payload_kg,
        payload_com=(row.payload_com_x_m, row.payload_com_y_m, row.payload_com_z_m),
        repeat_of=None if row.repeat_of is None else row.repeat_of.removeprefix(f"{row.robot_id}."),
        started=row.start_time,
        notes={},
        signals=from_columns(columns, robot.joint_names),
        performs=None if row.performs is None else row.performs.removeprefix(f"{row.robot_id}."),
    )


def check_plans(workspace: Workspace, robot_id: str, plans: Sequence[log.Run]) -> None:
    """Raise InputError where a planned motion is none that the robot can make, by its twin."""
    if not plans:
        return
    _, twin = load_twin(workspace, robot_id)
    collisions = CollisionModel(twin.robot)
    for run in plans:
        check_motion(twin, condition(run, twin.robot, twin.cutoff), collisions, run.file)


def load_twin(workspace: Workspace, robot_id: str) -> tuple[str, Twin]:
    """Give back a robot's twin with its twin_id. Raises InputError where it has none, or its file is gone."""
    known = known_twin(workspace, robot_id)
    if known is None:
        raise InputError(f"{workspace.folder}: robot {robot_id} has no twin yet; run its data set first")
    return known


def known_twin(workspace: Workspace, robot_id: str) -> tuple[str, Twin] | None:
    """Give back a robot's twin with its twin_id; None where it has none. Raises InputError where its file is gone."""
    row = workspace.first(select(TwinRow).where(TwinRow.robot_id == robot_id))
    if row is None:
        return None
    document = workspace.read_document(row.file, row.sha256)
    return row.twin_id, from_json(document, inside(workspace.folder, row.file))


def _source_files(robot_id: str, data_set: log.DataSet) -> list[SourceFile]:
    return [
        SourceFile(
            source_file_id=f"{robot_id}.{identifier(path)}",
            robot_id=robot_id,
            kind="URDF" if file == data_set.urdf else "data set",
            path=path,
            folder=str(data_set.folder.resolve()),
            sha256=checksum,
        )
        for file, checksum in data_set.sha256.items()
        for path in [_within(data_set.folder, file)]
    ]


def flat_notes(notes: Mapping[str, Any], below: str = "") -> dict[str, list[str]]:
    """Return the values of notes as text, by names: "supply.voltage" of a table within, several of a list."""
    flat: dict[str, list[str]] = {}
    for name, value in notes.items():
        if isinstance(value, Mapping):
            flat |= flat_notes(value, f"{below}{name}.")
        elif isinstance(value, list | tuple):
            flat[f"{below}{name}"] = [_text(item) for item in value]
        else:
            flat[f"{below}{name}"] = [_text(value)]
    return flat


def _text(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def _within(folder: Path, file: Path) -> str:
    """Return the path of a data set's file from its folder on; the whole path of one that lies elsewhere."""
    return (file.relative_to(folder) if file.is_relative_to(folder) else file.resolve()).as_posix()


def _robot_row(robot_id: str, data_set: log.DataSet) -> RobotRow:
    robot, notes = data_set.robot, data_set.notes
    rated, arm = notes.get("rated_payload"), notes.get("arm_movement_type")
    chain = "".join("P" if joint.kind == "prismatic" else "R" for joint in robot.joints)  # in the usual letters
    return RobotRow(
        robot_id=robot_id,
        name=robot.name,
        type=robot.type,
        manufacturer=robot.manufacturer,
        weight_kg=robot.weight,
        controlled_axes=len(robot.joints),
        arm_movement_type=arm if isinstance(arm, str) else chain,
        rated_payload_kg=float(rated) if isinstance(rated, int | float) else None,
        ambient_temperature_degc=data_set.ambient_temperature,
        power_measured_at=data_set.power_at,
        simulated=data_set.simulated,
        urdf=robot.urdf,
        urdf_sha256=hashlib.sha256(robot.urdf.encode()).hexdigest(),
        twin_effects=None if data_set.effects is None else ",".join(data_set.effects),
        cutoff_hz=data_set.cutoff,
        notes=json.dumps(dict(data_set.notes), default=str, sort_keys=True),
    )


def _joint_row(robot_id: str, place: int, joint: description.Joint) -> JointRow:
    limits = {column: getattr(joint, name) for name, column in _LIMITS.items()}
    finite = {column: limit for column, limit in limits.items() if math.isfinite(limit)}
    sheet = {column: getattr(joint, name) for name, column in _SHEET.items()}
    return JointRow(robot_id=robot_id, name=joint.name, position=place, kind=joint.kind, **finite, **sheet)


def _run_row(robot_id: str, run: log.Run, now: datetime, folder: Path | None = None) -> RunRow:
    time = run.signals.time
    duration = float(time[-1] - time[0])
    x, y, z = run.payload_com
    planned = run.role == log.PLANNED
    began = None if planned or run.started is None else in_utc(run.started)
    return RunRow(
        run_id=f"{robot_id}.{identifier(run.name)}",
        robot_id=robot_id,
        name=run.name,
        kind=PLANNED_RUN if planned else MEASURED_RUN,
        role=run.role,
        payload_kg=run.payload_mass,
        payload_com_x_m=x,
        payload_com_y_m=y,
        payload_com_z_m=z,
        repeat_of=None if run.repeat_of is None else f"{robot_id}.{identifier(run.repeat_of)}",
        performs=None if run.performs is None else f"{robot_id}.{identifier(run.performs)}",
        time_scaling_of=None if run.time_scaling_of is None else f"{robot_id}.{identifier(run.time_scaling_of)}",
        time_scale=run.time_scale,
        product=run.product,
        pieces=run.pieces,
        cycles=run.cycles,
        start_time=None if planned else began or now,
        start_time_from=None if planned else "log" if began else "ingest",
        started=began,
        ended=None if began is None else began + timedelta(seconds=duration),
        run_time_s=duration,
        sample_count=len(time),
        sample_rate_hz=(len(time) - 1) / duration,
        file=run.file.name if folder is None else _within(folder, run.file),
        sha256=run.sha256,
    )
