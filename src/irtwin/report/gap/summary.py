"""A diagnosis for the terminal: one line, the gap before and after its causes are added, and these causes.

Or, where nothing is diagnosed, how far a model is from the robot that it plays.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING

from irtwin.document.curves import Curves, RunError
from irtwin.document.document import Cause, CauseParameter, Document, Finding, pooled
from irtwin.effects.catalogue import catalogue
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.table import AnswerTable, Row
from irtwin.knowledge.vocabulary import EFFECT
from irtwin.report.gap import findings
from irtwin.report.gap.verdict import agrees, closes, differing, left, where
from irtwin.report.wording import listed

if TYPE_CHECKING:  # a diagnosis has no need of it
    from irtwin.simulator.played_log import PlayedLog

_TRACKING, _TORQUE = "tracking error, rad (m)", "torque, N m (N)"  # of a log that is played
_DIGITS = 3  # significant ones: more than any interval leaves sure
_MENDED = 3  # lines on what was done with logs, on a terminal
_CALLED_BACK = "dead_band"  # what is played that no file holds and a callback does
_SOFT = "K"  # of a joint that is played as soft: others in its file come nearest
_WORTH_SAYING = 0.01  # of friction, from run to run
_STEPS = 3  # motions to log that are told
_SPLIT = (
    "Torque shows sums over links (base parameters) alone: the mass, centre or inertia of a link, or a rotor, whose "
    "interval holds zero is not in the data, but split as the robot's description has it."
)
_MEANINGS = """SELECT ?effect ?name ?meaning {
    ?effect irt:has_Effect_Parameter|irt:has_Body_Quantity ?parameter .
    ?parameter irt:Parameter_Name ?name ; skos:definition ?meaning
}"""


def line(diagnosis: Document, against: str | None) -> str:
    """Return in one line what the page says first; `against`: role of the runs compared with, if any."""
    told = [_told(finding, against, diagnosis.causes) for finding in diagnosis.findings]
    place = next(iter(diagnosis.locations), None)
    shrink = diagnosis.shrink
    closed = shrink.closed_fraction
    tracking, torque = (None if error is None else error.before for error in (shrink.position_rmse, shrink.torque_rmse))
    sentence = findings.sentence(
        diagnosis.verdict,
        told,
        "" if place is None else where(place.channel, place.joint, place.regime and _words(place.regime), place.share),
        None if closed is None else closes(closed.value, closed.interval95, against, played=tracking is not None),
        diagnosis.unexplained_because,
        differing(
            [
                (disturbance.kind, disturbance.channel, disturbance.joint)
                for disturbance in diagnosis.not_repeating or ()
                if not disturbance.explained_by
            ]
        ),
        shrink.noise_floor_from is not None,
        agrees(against, tracking, torque),
        left([(size.joint, size.excess) for size in diagnosis.gap.sizes], since=against == "reference"),
    )
    numbers = findings.other_numbers([
        (parameter.name, parameter.joint, parameter.simulator, parameter.robot, parameter.unit, parameter.interval95)
        for cause in diagnosis.mattering
        for parameter in cause.parameters
        if cause.likely and parameter.simulator is not None and parameter.robot is not None
    ])  # fmt: skip
    look = findings.look_at(diagnosis.verdict, diagnosis.odd_stretches or ())
    return f"{diagnosis.verdict}: {numbers}{sentence}{look}".replace("\N{NO-BREAK SPACE}", " ")


def _told(finding: Finding, against: str | None, causes: Sequence[Cause]) -> findings.ToldFinding:
    runs = {cause.id: f" in {listed(cause.evidence.runs)}" for cause in causes if cause.evidence.runs}
    members = [[member for member in finding.members if member.cause == cause] for cause in finding.causes]
    return findings.ToldFinding(
        family=finding.family,
        joints=finding.joints,
        against="twin" if finding.scope == "missing" else against or "reference",
        channel=finding.channel,
        confidence=finding.confidence,
        share=finding.share,
        interval=finding.share_interval95,
        of=finding.share_of,
        matters=finding.matters,
        members=tuple(
            tuple((_words(member.effect) + runs.get(member.cause, ""), member.confidence) for member in some)
            for some in members
        ),
    )


def _words(name: str) -> str:
    return name.replace("_", " ")


def refused(diagnosis: Document) -> list[str]:
    """Return a line for each effect that was refused as a cause."""
    return [
        f"refused: {_words(refusal.effect)}{f' on {listed(refusal.joints)}' if refusal.joints else ''}: {refusal.why}"
        for refusal in diagnosis.refused or ()
    ]


def gap(diagnosis: Document) -> AnswerTable:
    """Return the gap on runs outside the fit: torque, power and position as RMSE, energy as its error."""
    changes = (
        ("torque (RMSE)", diagnosis.shrink.torque_rmse, "N m"),  # of joints that slide, N
        ("power (RMSE)", diagnosis.shrink.power_rmse, "W"),
        ("tracking error (RMSE)", diagnosis.shrink.position_rmse, "rad"),  # of joints that slide, m
        ("energy (error)", diagnosis.shrink.energy_error_percent, "%"),
    )
    rows = [
        (name, _short(change.before), _short(change.after), _short(change.noise_floor), unit)
        for name, change, unit in changes
        if change is not None
    ]
    return _table(("gap", "before", "after", "noise floor", "unit"), rows)


def runs(curves: Curves) -> AnswerTable:
    """Return the tracking error of each run that was played, over its joints and at the flange."""
    columns = ("run", "tracking error, rad", "with the causes", "flange, m", "with the causes, m")
    of_run: dict[str, list[RunError]] = {}
    for error in curves.runs:
        if error.joint is None and error.of:
            of_run.setdefault(error.run, []).append(error)
    rows = [
        (run, *(_short(value) for error in errors for value in (error.before, error.after)))
        for run, errors in of_run.items()
    ]
    return _table(columns, rows)


def horizons(diagnosis: Document) -> AnswerTable:
    """Return how tracking error grows after a run is begun anew as the robot was."""
    columns = ("s since it was begun anew", "tracking error, rad", "with the causes, rad")
    rows = [(horizon.seconds, _short(horizon.before), _short(horizon.after)) for horizon in diagnosis.horizons or ()]
    return _table(columns, rows)


def played(log: PlayedLog) -> Iterator[AnswerTable]:
    """Yield how far a model is from the robot that it plays: by run, by joint, by how long ago it was where that is.

    A table has no columns that are empty.
    """
    by_run: list[Row] = [
        {
            "run": run.run,
            _TRACKING: _together(run.position_rmse.values()),
            "flange, m": _together([run.flange_rmse]),
            _TORQUE: _together((run.torque_rmse or {}).values()),
            "energy error, %": _short(run.energy_error_percent),
        }
        for run in log.runs
    ]
    by_joint: list[Row] = [
        {
            "joint": joint,
            _TRACKING: _together(run.position_rmse[joint] for run in log.runs),
            _TORQUE: _together(run.torque_rmse[joint] for run in log.runs if run.torque_rmse),
        }
        for joint in log.runs[0].position_rmse
    ]
    by_horizon: list[Row] = [
        {"s since it was begun anew": horizon.seconds, _TRACKING: _short(horizon.position_rmse)}
        for horizon in log.horizons
    ]
    for rows in (by_run, by_joint, by_horizon):
        columns = tuple(column for column in rows[0] if any(row[column] is not None for row in rows))
        yield AnswerTable(columns, tuple(rows))


def _together(errors: Iterable[float]) -> float | None:
    known = list(errors)
    return _short(pooled(known)) if known else None


def filtered(diagnosis: Document) -> list[str]:
    """Return lines on the filter that all runs passed, on friction from run to run, and on what was done with logs."""
    cutoff, mended = diagnosis.cutoff, (diagnosis.mended or "").splitlines()
    lines = [f"Signals were low-pass filtered at {cutoff.hz:.{_DIGITS}g} Hz ({cutoff.why})."] if cutoff else []
    if len(mended) > _MENDED:
        mended[_MENDED:] = [f"and {len(mended) - _MENDED} more, which `irtwin check` lists"]
    read = [f"Of the logs, when they were read: {'; '.join(mended)}."] if mended else []
    return [*lines, *_differing_friction(diagnosis), *read]


def _differing_friction(diagnosis: Document) -> list[str]:
    spread = diagnosis.friction_spread
    shares = (("dry", spread.dry), ("viscous", spread.viscous)) if spread else ()
    told = [f"{name} by {100 * share:.2g} %" for name, share in shares if share and share >= _WORTH_SAYING]
    return [f"Friction differs from run to run, {listed(told)} (one standard deviation): noise."] if told else []


def causes(diagnosis: Document, against: str | None) -> AnswerTable:
    """Return each cause that matters with its confidence and its parameters, these with their 95 % intervals.

    Beside a simulator, `against` as of `line`, the value is the change from its number to the robot's.
    """
    rows = tuple(_rows_of_causes(diagnosis))
    beside = against == "simulated"
    value = ("simulator", "robot", "change") if beside else ("value",)
    columns = ("cause", "joints", "sure, %", "parameter", *value, "95 % from", "to", "unit")
    return AnswerTable(columns, tuple({**row, "change": row["value"]} if beside else row for row in rows))


def _rows_of_causes(diagnosis: Document) -> Iterator[Row]:
    for cause in diagnosis.mattering:
        name = _words(cause.effect)
        first: Row = {
            "cause": name if cause.likely else f"perhaps {name}",
            "joints": ", ".join((*(cause.joints or ("whole robot",)), *(cause.evidence.runs or ()))),
            "sure, %": round(100 * cause.confidence),
        }
        nothing = dict.fromkeys(("parameter", "simulator", "robot", "value", "95 % from", "to", "unit"))
        if not cause.parameters:
            yield first | nothing
        for parameter in cause.parameters:
            lower, upper = parameter.interval95 or (None, None)
            yield first | {
                "parameter": f"{parameter.name} of {parameter.joint}"
                if parameter.joint and len(cause.joints) != 1
                else parameter.name,
                "simulator": _short(parameter.simulator),
                "robot": _short(parameter.robot),
                "value": _short(parameter.value),
                "95 % from": _short(lower),
                "to": _short(upper),
                "unit": "" if parameter.unit == "1" else parameter.unit,
            }
            first = dict.fromkeys(first)  # said once


def meanings(diagnosis: Document) -> list[str]:
    """Return what each parameter of the causes that matter means, in the ontology's words, as far as it has any."""
    parameters = {  # each once, and of a vector's parts ("f_x"), or links' ("mass (link_1)"), the whole
        (cause.effect, re.split("[_ ]", parameter.name)[0]): None
        for cause in diagnosis.mattering
        for parameter in cause.parameters
    }
    if not parameters:
        return []
    with KnowledgeGraph() as graph:
        graph.load_ontology()
        meaning = {(row["effect"].removeprefix(EFFECT), row["name"]): row["meaning"] for row in graph.query(_MEANINGS)}
    known = [
        f"{name} of {_words(effect)}: {meaning[effect, name]}"
        for effect, name in parameters
        if (effect, name) in meaning
    ]
    bodies = {effect.id for effect in catalogue().values() if effect.bodies}
    split = diagnosis.simulator is not None and any(cause.effect in bodies for cause in diagnosis.mattering)
    return [*known, _SPLIT] if split else known


def not_held(causes: Sequence[Cause], diagnosis: Document) -> list[str]:
    """Return lines on each cause of which the simulator's model keeps something: what, why, and how much of a gap."""
    lines = []
    for cause in causes:
        file_has = catalogue()[cause.effect].changed_in_mjcf if cause.effect in catalogue() else {}
        unsure = [own for own in cause.parameters if own.joint and own.name in file_has]
        others = [own for own in cause.parameters if own not in unsure]
        if others:
            lines.append(
                f"No number of a joint holds {_words(cause.effect)} ({_named(others) or 'whole robot'}): "
                f"the simulator's model keeps that difference{_kept(cause, diagnosis)}."
            )
        if unsure:
            lines.append(
                f"The simulator's model keeps its own {_named(unsure)} ({_words(cause.effect)}): its format has none, "
                "or another is not sure to be better in it, without what no number holds."
            )
    return lines


def _named(parameters: Sequence[CauseParameter]) -> str:
    """Return names with the joints of each: "k of joint_2, joint_3; d of joint_2"."""
    joints: dict[str, list[str]] = {}
    for parameter in parameters:
        joints.setdefault(parameter.name, []).extend([parameter.joint] if parameter.joint else [])
    return "; ".join(f"{name} of {', '.join(on)}" if on else name for name, on in joints.items())


def _kept(cause: Cause, diagnosis: Document) -> str:
    """Return what a model leaves of its tracking error that has all numbers of the robot but a cause's."""
    names = [parameter.name for parameter in cause.parameters]
    by, is_soft = "irtwin.simulator.callback" if _CALLED_BACK in names else "it", _SOFT in names
    for change in diagnosis.shrink.by_cause:
        if change.cause == cause.id and change.channel == "position":
            left, all_ = (1e3 * pooled(some) for some in (change.rmse_when_left_out, change.rmse_with_all))
            written = "; a file that is written has the others that come nearest" if is_soft else ""
            return f", {_short(left)} mrad (mm) RMS where {_short(all_)} are left with {by}{written}"
    return ""


def next_steps(diagnosis: Document) -> list[str]:
    """Return what to log next: a line for each of the first few motions, and how many more the report has.

    Nothing where the verdict leaves nothing open: what else could be shown is in the report.
    """
    is_open = diagnosis.verdict in ("ambiguous", "unexplained")
    motions = diagnosis.next_experiment.motions if diagnosis.next_experiment and is_open else ()
    steps = [f"To log next: {motion}" for motion in motions[:_STEPS]]
    return steps + ([f"{len(motions) - _STEPS} more to log are in the report (--report)"] if motions[_STEPS:] else [])


def _table(columns: tuple[str, ...], rows: Iterable[Sequence[object]]) -> AnswerTable:
    return AnswerTable(columns, tuple(dict(zip(columns, row, strict=True)) for row in rows))


def _short(value: float | None) -> float | None:
    return None if value is None else float(f"{value:.{_DIGITS}g}")
