"""The providers of a diagnosis and of the twin that it proposes; both wait for the user's command."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import UTC, datetime
from importlib.metadata import version
from typing import Any

from sqlalchemy import select

from irtwin.errors import InputError
from irtwin.identification.validation import split
from irtwin.providers.identification import twin_made
from irtwin.providers.motions import robot_motions
from irtwin.providers.provider import Made
from irtwin.providers.records import identifier, robot_iri, run_iri
from irtwin.storage import gap_schema, schema
from irtwin.storage.database import DIAGNOSES, Workspace
from irtwin.storage.files import inside
from irtwin.storage.schema import Base
from irtwin.twin.files import from_json
from irtwin.twin.identify import identify

Json = Mapping[str, Any]

_UNITS = {"torque_rmse": "N m", "power_rmse": "W", "energy_error_percent": "%"}


def record(
    workspace: Workspace, robot_id: str, diagnosis: Json, evidence: Json, twin: str | None = None
) -> gap_schema.GapDiagnosis:
    """Keep a robot's diagnosis, in place of an earlier one; return its row.

    diagnosis: as the contract's schema says; evidence: the arrays of its curves (JSON); twin: text of the twin with
    the causes added, which `adopt` makes the robot's. Raises InputError where the workspace lacks the robot, or a
    run or joint that the diagnosis names.
    """
    started = datetime.now(UTC)
    runs = _run_ids(workspace, robot_id)
    _check_joints(workspace, robot_id, diagnosis)
    row, documents = _row(robot_id, diagnosis, evidence, twin)
    rows = [
        row,
        *_sizes(row.diagnosis_id, robot_id, diagnosis["gap"]),
        *_locations(row.diagnosis_id, robot_id, diagnosis["locations"], runs),
        *_causes(row.diagnosis_id, robot_id, diagnosis["causes"]),
        *_changes(row.diagnosis_id, diagnosis),
        *_shrinkage(row.diagnosis_id, diagnosis["shrink"].get("closed_fraction")),
        *(
            gap_schema.GapHeldOut(diagnosis_id=row.diagnosis_id, run_id=_run_id(runs, name))
            for name in dict.fromkeys(diagnosis["shrink"].get("held_out_runs") or [])
        ),
        *(
            gap_schema.GapNotTestable(
                diagnosis_id=row.diagnosis_id, number=number, effect=item["effect"], why=item["why"]
            )
            for number, item in enumerate(diagnosis["not_testable"], start=1)
        ),
    ]
    if diagnosis.get("next_experiment"):
        described = _text(diagnosis["next_experiment"])
        rows.append(gap_schema.GapExperiment(diagnosis_id=row.diagnosis_id, description=described))
    made = Made(robot_id, [run_iri(run_id) for run_id in runs.values()], rows, documents=documents)
    diagnosis_id = row.diagnosis_id
    _keep(workspace, "diagnosis", made, started)
    with workspace.reading() as session:
        return session.get_one(gap_schema.GapDiagnosis, diagnosis_id)


def adopt(workspace: Workspace, robot_id: str) -> str:
    """Make the twin with the diagnosis' causes added the robot's twin; return its twin_id.

    Its effects are the diagnosis'; its numbers are fitted again without the runs that then judge it, as every twin's
    are. Runs that the diagnosis left out, as from before a change, are neither. The earlier twin and what was made with
    it are dropped: providers populate anew. The diagnosis stays.
    Raises InputError where there is no diagnosis, or it added nothing to the twin.
    """
    started = datetime.now(UTC)
    with workspace.reading() as session:
        of_robot = select(gap_schema.GapDiagnosis).where(gap_schema.GapDiagnosis.robot_id == robot_id)
        found = session.scalars(of_robot).one_or_none()
    if found is None:
        raise InputError(f"{robot_id}: no diagnosis in {workspace.folder}; run `irtwin diagnose` with it first")
    if found.twin_file is None or found.twin_sha256 is None:
        raise InputError(
            f"{robot_id}: its diagnosis ({found.verdict}) added nothing to the twin, so there is nothing to adopt"
        )
    text = workspace.read_document(found.twin_file, found.twin_sha256).decode()
    twin = from_json(text, inside(workspace.folder, found.twin_file))
    known = robot_motions(workspace, robot_id)
    parts = split([motion for motion in known.motions.values() if motion.run in twin.fitted], known.repeats)
    parts = replace(parts, rule=f"{parts.rule}; which effects, a diagnosis of all these runs had said")
    made = twin_made(robot_id, identify(known.robot, parts.fit, twin.effects), known.keys, parts)
    used = [*made.used, f"https://w3id.org/irtwin/id/gap_diagnosis/{found.diagnosis_id}"]
    twin_id = next(row.twin_id for row in made.rows if isinstance(row, schema.Twin))
    _keep(workspace, "adoption", Made(robot_id, used, made.rows, documents=made.documents), started, "identification")
    return twin_id


def _keep(workspace: Workspace, provider: str, made: Made, started: datetime, instead_of: str | None = None) -> None:
    activity = schema.Activity(
        activity_id=f"{provider}.{made.robot_id}.{started:%Y%m%dT%H%M%S%f}",
        robot_id=made.robot_id,
        provider=provider,
        subject=robot_iri(made.robot_id),
        started=started,
        ended=datetime.now(UTC),
        software=f"irtwin {version('irtwin')}",
    )
    workspace.replace_activity(activity, made.used, made.rows, documents=made.documents, instead_of=instead_of)


def _run_ids(workspace: Workspace, robot_id: str) -> dict[str, str]:
    """Return the robot's runs, by the end of their run_id; InputError where the robot is unknown."""
    with workspace.reading() as session:
        if session.get(schema.Robot, robot_id) is None:
            raise InputError(f"{workspace.folder}: no robot {robot_id} here; run `irtwin run` on its data set first")
        found = session.scalars(select(schema.Run.run_id).where(schema.Run.robot_id == robot_id)).all()
    return {run_id.removeprefix(f"{robot_id}."): run_id for run_id in sorted(found)}


def _run_id(runs: Mapping[str, str], name: str) -> str:
    if identifier(name) not in runs:
        raise InputError(
            f'run "{name}" of the diagnosis is not in the workspace; run `irtwin run` on its data set first'
        )
    return runs[identifier(name)]


def _check_joints(workspace: Workspace, robot_id: str, diagnosis: Json) -> None:
    with workspace.reading() as session:
        known = set(session.scalars(select(schema.Joint.name).where(schema.Joint.robot_id == robot_id)))
    named = {*(diagnosis["gap"].get("torque") or {})}
    named |= {location["joint"] for location in diagnosis["locations"] if location.get("joint")}
    named |= {joint for cause in diagnosis["causes"] for joint in cause["joints"]}
    if named - known:
        raise InputError(
            f"{robot_id} has no joint {', '.join(sorted(named - known))}; diagnose a data set of this robot"
        )


def _row(
    robot_id: str, diagnosis: Json, evidence: Json, twin: str | None
) -> tuple[gap_schema.GapDiagnosis, dict[str, bytes]]:
    texts = {"": _text(diagnosis), ".evidence": _text(evidence)} | ({} if twin is None else {".twin": twin})
    sums = {kind: hashlib.sha256(text.encode()).hexdigest() for kind, text in texts.items()}
    diagnosis_id = f"{robot_id}.{sums[''][:12]}"
    files = {kind: f"{DIAGNOSES}/{diagnosis_id}{kind}.json" for kind in texts}
    row = gap_schema.GapDiagnosis(
        diagnosis_id=diagnosis_id,
        robot_id=robot_id,
        verdict=diagnosis["verdict"],
        created=datetime.now(UTC),
        energy_error_percent=diagnosis["gap"].get("energy_error_percent"),
        noise_floor_from=diagnosis["shrink"].get("noise_floor_from"),
        file=files[""],
        sha256=sums[""],
        evidence_file=files[".evidence"],
        evidence_sha256=sums[".evidence"],
        twin_file=files.get(".twin"),
        twin_sha256=sums.get(".twin"),
    )
    return row, {files[kind]: text.encode() for kind, text in texts.items()}


def _text(value: object) -> str:
    return json.dumps(_finite(value), sort_keys=True, ensure_ascii=False, allow_nan=False)


def _finite(value: Any) -> Any:
    """Return the value with None for numbers that JSON does not have."""
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {key: _finite(one) for key, one in value.items()}
    return [_finite(one) for one in value] if isinstance(value, list | tuple) else value


def _sizes(diagnosis_id: str, robot_id: str, gap: Json) -> Iterator[Base]:
    sizes: list[tuple[str, str | None, Json]] = [
        ("torque", joint, of) for joint, of in (gap.get("torque") or {}).items()
    ]
    if (gap.get("power") or {}).get("rmse") is not None:
        sizes.append(("power", None, gap["power"]))
    for channel, joint, size in sizes:
        yield gap_schema.GapSize(
            diagnosis_id=diagnosis_id,
            channel=channel,
            place=joint or "robot",
            joint=joint,
            robot_id=robot_id,
            rmse=size["rmse"],
            noise_floor=size.get("noise_floor"),
            excess=size.get("excess"),
            unit="N m" if channel == "torque" else "W",
        )


def _locations(diagnosis_id: str, robot_id: str, locations: Sequence[Json], runs: Mapping[str, str]) -> Iterator[Base]:
    for rank, location in enumerate(locations, start=1):
        yield gap_schema.GapLocation(
            diagnosis_id=diagnosis_id,
            rank=rank,
            robot_id=robot_id,
            channel=location["channel"],
            joint=location.get("joint"),
            regime=location.get("regime"),
            follows=location.get("follows"),
            share=location["share"],
        )
        for name in dict.fromkeys(location.get("runs") or []):
            yield gap_schema.GapLocationRun(diagnosis_id=diagnosis_id, rank=rank, run_id=_run_id(runs, name))


def _causes(diagnosis_id: str, robot_id: str, causes: Sequence[Json]) -> Iterator[Base]:
    for rank, cause in enumerate(causes, start=1):
        yield gap_schema.GapCause(
            diagnosis_id=diagnosis_id,
            rank=rank,
            robot_id=robot_id,
            effect=cause["effect"],
            scope=cause["scope"],
            confidence=cause["confidence"],
            evidence=_text(cause.get("evidence") or {}),
        )
        for joint in dict.fromkeys(cause["joints"]):
            yield gap_schema.GapCauseJoint(diagnosis_id=diagnosis_id, rank=rank, joint=joint, robot_id=robot_id)
        for rival in dict.fromkeys(cause["indistinguishable_from"]):
            yield gap_schema.GapCauseRival(diagnosis_id=diagnosis_id, rank=rank, effect=rival)
        for number, parameter in enumerate(cause["parameters"], start=1):
            lower, upper = parameter["interval95"] or (None, None)
            yield gap_schema.GapCauseParameter(
                diagnosis_id=diagnosis_id,
                rank=rank,
                number=number,
                robot_id=robot_id,
                joint=parameter.get("joint"),
                name=parameter["name"],
                value=parameter["value"],
                unit=parameter["unit"],
                lower=lower,
                upper=upper,
            )


def _changes(diagnosis_id: str, diagnosis: Json) -> Iterator[Base]:
    """What all causes change together; and, where it is said, each alone and all without it."""

    def row(measure: str, part: str, rank: int | None, change: Json) -> Base:
        lower, upper = change.get("interval95_after") or (None, None)
        return gap_schema.GapChange(
            diagnosis_id=diagnosis_id,
            measure=measure,
            part=part,
            place=rank or 0,
            rank=rank,
            before=change["before"],
            after=change["after"],
            noise_floor=change.get("noise_floor"),
            lower=lower,
            upper=upper,
            unit=_UNITS[measure],
        )

    shrink = diagnosis["shrink"]
    for measure in _UNITS:
        if shrink.get(measure):
            yield row(measure, "together", None, shrink[measure])
    ranks = [(rank, cause["effect"], cause["scope"]) for rank, cause in enumerate(diagnosis["causes"], start=1)]
    for item in shrink.get("by_cause") or []:
        found = next((one for one in ranks if one[1:] == (item["effect"], item["scope"])), None)
        if found is None:
            continue
        ranks.remove(found)  # the same effect may be a cause again, on another joint
        for part, key in (("alone", "rmse_alone"), ("without", "rmse_when_left_out")):
            change = {"before": _pooled(item["rmse_before"]), "after": _pooled(item[key])}
            yield row(f"{item['channel']}_rmse", part, found[0], change)


def _pooled(values: Sequence[float]) -> float:
    """Return the root of the mean square over joints."""
    return math.sqrt(sum(value**2 for value in values) / len(values))


def _shrinkage(diagnosis_id: str, closed: Json | None) -> Iterator[Base]:
    if closed:
        lower, upper = closed.get("interval95") or (None, None)
        yield gap_schema.GapShrinkage(
            diagnosis_id=diagnosis_id, closed_fraction=closed["value"], lower=lower, upper=upper
        )
