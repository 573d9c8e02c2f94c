"""The providers of a diagnosis and of the twin that it proposes; both wait for the user's command."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable
from dataclasses import replace
from datetime import UTC, datetime

from sqlalchemy import select

from irtwin.document.curves import Curves
from irtwin.document.document import Document
from irtwin.errors import InputError
from irtwin.identification.validation import split
from irtwin.providers import gap_rows
from irtwin.providers.gap_rows import Of
from irtwin.providers.identification import twin_made
from irtwin.providers.motions import robot_motions
from irtwin.providers.names import robot_iri
from irtwin.providers.provider import Made, activity, keep
from irtwin.providers.records import inputs, rows_of
from irtwin.signals.log import DataSet
from irtwin.storage.database import DIAGNOSES, Workspace
from irtwin.storage.files import inside
from irtwin.storage.gap_schema import GapDiagnosis, OfDiagnosis
from irtwin.storage.rows import values
from irtwin.storage.schema import Base, JointRow, RobotRow, RunRow
from irtwin.twin.files import from_json
from irtwin.twin.identify import identify


def record(
    workspace: Workspace,
    robot_id: str,
    diagnosis: Document,
    curves: Curves,
    twin: str | None = None,
    motion: str | None = None,
) -> GapDiagnosis:
    """Keep a robot's diagnosis, in place of an earlier one; return its row.

    curves: what a page draws of it; twin: text of the twin with the causes added, which `adopt` makes the robot's;
    motion: CSV of what the next experiment plays.
    Raises InputError where the workspace lacks the robot, or a run or joint that the diagnosis names.
    """
    started = datetime.now(UTC)
    if workspace.first(select(RobotRow).where(RobotRow.robot_id == robot_id)) is None:
        raise InputError(f"{workspace.folder}: no robot {robot_id} here; run `irtwin run` on its data set first")
    runs = workspace.all(select(RunRow).where(RunRow.robot_id == robot_id))
    joints = workspace.all(select(JointRow).where(JointRow.robot_id == robot_id))
    row, parts, documents = _rows(robot_id, joints, runs, diagnosis, curves, twin, motion)
    used = inputs(workspace, robot_id, [run.run_id for run in runs])
    keep(workspace, "diagnosis", Made(robot_id, used, [row, *parts], documents=documents), started)
    return row


def unrecorded(data_set: DataSet, diagnosis: Document, curves: Curves) -> tuple[list[Base], dict[str, bytes]]:
    """Return the rows of a data set and its diagnosis as a workspace would have them, and the documents by their path.

    Of samples and meshes, which are files of the workspace, there is none.
    """
    started = datetime.now(UTC)
    robot, parts, runs = rows_of(data_set, {})
    joints = [part for part in parts if isinstance(part, JointRow)]
    row, own, documents = _rows(robot.robot_id, joints, runs, diagnosis, curves)
    judged = activity("diagnosis", robot.robot_id, robot_iri(robot.robot_id), started)
    for kept in (row, *own):
        kept.activity_id = judged.activity_id  # type: ignore[attr-defined]
    return [robot, *parts, *runs, judged, row, *own], documents


def adopt(workspace: Workspace, robot_id: str) -> str:
    """Make the twin with the diagnosis' causes added the robot's twin; return its twin_id.

    Its effects are the diagnosis'; its numbers are fitted again without the runs that then judge it, as every twin's
    are. Runs that the diagnosis left out, as from before a change, are neither. The earlier twin and what was made with
    it are dropped: providers populate anew. The diagnosis stays.
    Raises InputError where there is no diagnosis, or it added nothing to the twin.
    """
    started = datetime.now(UTC)
    diagnosis = workspace.first(select(GapDiagnosis).where(GapDiagnosis.robot_id == robot_id))
    if diagnosis is None:
        raise InputError(f"{robot_id}: no diagnosis in {workspace.folder}; run `irtwin diagnose` with it first")
    if diagnosis.twin_file is None or diagnosis.twin_sha256 is None:
        raise InputError(
            f"{robot_id}: its diagnosis ({values(diagnosis)['verdict']}) added nothing to the twin, so there is "
            "nothing to adopt"
        )
    text = workspace.read_document(diagnosis.twin_file, diagnosis.twin_sha256)
    twin = from_json(text, inside(workspace.folder, diagnosis.twin_file))
    known = robot_motions(workspace, robot_id)
    parts = split([motion for motion in known.motions.values() if motion.run in twin.fitted], known.repeats)
    parts = replace(parts, rule=f"{parts.rule}; which effects, a diagnosis of all these runs had said")
    twin_id, made = twin_made(workspace, robot_id, identify(known.robot, parts.fit, twin.effects), known, parts)
    adopted = replace(made, used=[*made.used, f"gap_diagnosis/{diagnosis.diagnosis_id}"])
    keep(workspace, "adoption", adopted, started, instead_of="identification")
    return twin_id


def _rows(
    robot_id: str,
    joints: Iterable[JointRow],
    runs: Iterable[RunRow],
    diagnosis: Document,
    curves: Curves,
    twin: str | None = None,
    motion: str | None = None,
) -> tuple[GapDiagnosis, list[OfDiagnosis], dict[str, bytes]]:
    """Return the row of a diagnosis, those of its parts, and the documents that it names, by their path."""
    given = {
        ".json": _text(diagnosis.to_json()), ".evidence.json": _text(curves.to_json()), ".twin.json": twin,
        ".motion.csv": motion,
    }  # fmt: skip
    texts = {ending: text for ending, text in given.items() if text is not None}
    sums = {kind: hashlib.sha256(text.encode()).hexdigest() for kind, text in texts.items()}
    diagnosis_id = f"{robot_id}.{sums['.json'][:12]}"
    files = {kind: f"{DIAGNOSES}/{diagnosis_id}{kind}" for kind in texts}
    ids = {run.run_id.removeprefix(f"{robot_id}."): run.run_id for run in runs}
    of = Of(diagnosis_id, robot_id, ids, {joint.name: joint.kind for joint in joints})
    row = GapDiagnosis(
        diagnosis_id=diagnosis_id,
        robot_id=robot_id,
        created=datetime.now(UTC),
        file=files[".json"],
        sha256=sums[".json"],
        evidence_file=files[".evidence.json"],
        evidence_sha256=sums[".evidence.json"],
        twin_file=files.get(".twin.json"),
        twin_sha256=sums.get(".twin.json"),
        motion_file=files.get(".motion.csv"),
        motion_sha256=sums.get(".motion.csv"),
        **gap_rows.row(diagnosis, of),
    )
    documents = {files[kind]: text.encode() for kind, text in texts.items()}
    return row, [*gap_rows.rows(diagnosis, curves, of)], documents


def _text(value: object) -> str:
    return json.dumps(value, sort_keys=True, ensure_ascii=False, allow_nan=False)
