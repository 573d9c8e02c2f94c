"""The rows of a diagnosis, from its document: one function for each table or two."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

from irtwin.document.curves import Curves
from irtwin.document.document import Cause, Change, Document, Finding, Location, NotRepeating
from irtwin.providers.experiment_rows import rows_of_experiment
from irtwin.storage import gap_schema
from irtwin.storage.gap_schema import OfDiagnosis

ALL = "all"  # stands for every cause where a row's key needs one


@dataclass(frozen=True)
class Place:
    """What the rows of a diagnosis belong to; `run_id` gives a run's, by its name in the document.

    `linear`: the joints whose positions are in m, not rad.
    """

    diagnosis_id: str
    robot_id: str
    run_id: Callable[[str], str]
    linear: frozenset[str]

    def unit(self, channel: str, joint: str | None) -> str:
        """Return the unit of a residual of "torque" or "power"."""
        if channel != "torque":
            return "W"
        return "N" if joint in self.linear else "N m"


def rows(said: Document, at: Place) -> Iterator[OfDiagnosis]:
    """Yield all rows of a diagnosis but its own."""
    return _owned(_rows(said, at), at)


def _owned(rows: Iterable[OfDiagnosis], at: Place) -> Iterator[OfDiagnosis]:
    """Say in each row which diagnosis it is of; and of which robot, where it names a joint."""
    owner = {"diagnosis_id": at.diagnosis_id, "robot_id": at.robot_id}
    for row in rows:
        for column in owner.keys() & row.__table__.columns.keys():
            setattr(row, column, owner[column])
        yield row


def _rows(said: Document, at: Place) -> Iterator[OfDiagnosis]:
    yield from _sizes(said, at)
    yield from _locations(said, at)
    for rank, finding in enumerate(said.findings, start=1):
        yield from _finding(finding, rank)
    for rank, disturbance in enumerate(said.not_repeating or (), start=1):
        yield from _disturbance(disturbance, rank, at)
    for rank, cause in enumerate(said.causes, start=1):
        yield from _cause(cause, rank, at)
    yield from _changes(said)
    yield from _closing(said)
    for name in dict.fromkeys(said.shrink.held_out_runs):
        yield gap_schema.GapHeldOut(run_id=at.run_id(name))
    for number, one in enumerate(said.not_testable, start=1):
        yield gap_schema.GapNotTestable(number=number, effect=one.effect, why=one.why)
    for number, refused in enumerate(said.refused or (), start=1):
        joint = next(iter(refused.joints), None)
        yield gap_schema.GapRefused(
            number=number,
            effect=refused.effect,
            joint=joint,
            why=refused.why,
        )
    if said.next_experiment is not None:
        yield from rows_of_experiment(said.next_experiment, at.linear)


def rows_of_curves(drawn: Curves, at: Place) -> Iterator[OfDiagnosis]:
    """Yield the rows of what a page says in numbers of the evidence; curves stay in its file."""
    return _owned(_rows_of_curves(drawn, at), at)


def _rows_of_curves(drawn: Curves, at: Place) -> Iterator[OfDiagnosis]:
    if drawn.heat_map is not None:
        for joint, values in zip(drawn.heat_map.joints, drawn.heat_map.excess, strict=True):
            for rank, (regime, excess) in enumerate(zip(drawn.heat_map.regimes, values, strict=True), start=1):
                yield gap_schema.GapRegimeExcess(
                    joint=joint,
                    regime=regime,
                    rank=rank,
                    excess=_finite(excess),
                )
    for number, one in enumerate(drawn.runs, start=1):
        yield gap_schema.GapRunChange(
            number=number,
            run_id=at.run_id(one.run),
            measure="power_rmse" if one.joint is None else "torque_rmse",
            joint=one.joint,
            before=_finite(one.before),
            after=_finite(one.after),
            noise_floor=_finite(one.floor),
            unit=at.unit("power" if one.joint is None else "torque", one.joint),
        )


def _finite(value: float | None) -> float | None:
    return value if value is not None and math.isfinite(value) else None


def _sizes(said: Document, at: Place) -> Iterator[OfDiagnosis]:
    sizes = [("torque", joint, size) for joint, size in (said.gap.torque or {}).items()]
    power = [("power", None, said.gap.power)] if said.gap.power is not None else []
    for channel, joint, size in [*sizes, *power]:
        yield gap_schema.GapSize(
            channel=channel,
            place=joint or "robot",
            joint=joint,
            rmse=size.rmse,
            noise_floor=size.noise_floor,
            excess=size.excess,
            sensor_noise=size.sensor_noise,
            unit=at.unit(channel, joint),
        )


def _locations(said: Document, at: Place) -> Iterator[OfDiagnosis]:
    for rank, one in enumerate(said.locations, start=1):
        key = {"location_id": _location_id(one)}
        yield gap_schema.GapLocation(
            **key,
            rank=rank,
            channel=one.channel,
            joint=one.joint,
            regime=one.regime,
            follows=one.follows,
            share=one.share,
            share_lower=one.share_interval95[0],
            share_upper=one.share_interval95[1],
            excess=one.excess,
            excess_lower=one.excess_interval95[0],
            excess_upper=one.excess_interval95[1],
            concentration=one.concentration,
            false_discovery_rate=one.false_discovery_rate,
        )
        for name in dict.fromkeys(one.runs or ()):
            yield gap_schema.GapLocationRun(**key, run_id=at.run_id(name))


def _location_id(one: Location) -> str:
    """Return the name of a place, such as "torque@joint_2:reversal": a diagnosis names each place once."""
    joint = "" if one.joint is None else f"@{one.joint}"
    return f"{one.channel}{joint}" + ("" if one.regime is None else f":{one.regime}")


def _finding(said: Finding, rank: int) -> Iterator[OfDiagnosis]:
    key = {"finding_id": said.id}
    yield gap_schema.GapFinding(
        **key,
        rank=rank,
        family=said.family,
        scope=said.scope,
        channel=said.channel,
        confidence=said.confidence,
        share=said.share,
        share_lower=said.share_interval95[0],
        share_upper=said.share_interval95[1],
        share_of=said.share_of,
        matters=said.matters,
    )
    for joint in dict.fromkeys(said.joints):
        yield gap_schema.GapFindingJoint(**key, joint=joint)
    for number, one in enumerate(said.members, start=1):
        yield gap_schema.GapFindingMember(
            **key, number=number, cause_id=one.cause, effect=one.effect, confidence=one.confidence
        )


def _disturbance(said: NotRepeating, rank: int, at: Place) -> Iterator[OfDiagnosis]:
    key = {"disturbance_id": said.id}
    yield gap_schema.GapDisturbance(
        **key,
        rank=rank,
        channel=said.channel,
        joint=said.joint,
        kind=said.kind,
        rms=said.rms,
        unit=at.unit(said.channel, said.joint),
        share=said.share,
        cause_id=said.explained_by,
    )
    for number, one in enumerate(said.quantities, start=1):
        lower, upper = one.interval95 or (None, None)
        yield gap_schema.GapDisturbanceQuantity(
            **key, number=number, name=one.name, value=one.value, unit=one.unit, lower=lower, upper=upper
        )


def _cause(said: Cause, rank: int, at: Place) -> Iterator[OfDiagnosis]:
    why, key = said.evidence, {"cause_id": said.id}
    start, stop = why.window or (None, None)
    yield gap_schema.GapCause(
        **key,
        rank=rank,
        effect=said.effect,
        scope=said.scope,
        confidence=said.confidence,
        channel=why.channel,
        share_of_closed=why.share_of_what_is_closed,
        closed_where_it_acts=why.closed_where_it_acts,
        gain=why.gain,
        log_odds=why.log_odds,
        acts_from_s=start,
        acts_until_s=stop,
    )
    for joint in dict.fromkeys(said.joints):
        yield gap_schema.GapCauseJoint(**key, joint=joint)
    for rival in dict.fromkeys(said.indistinguishable_from):
        yield gap_schema.GapCauseRival(**key, effect=rival)
    for effect, probability in why.probability_of_rivals.items():
        yield gap_schema.GapCauseCompetitor(**key, effect=effect, probability=probability)
    for name in dict.fromkeys(why.runs or ()):
        yield gap_schema.GapCauseRun(**key, run_id=at.run_id(name))
    for number, one in enumerate(said.parameters, start=1):
        lower, upper = one.interval95 or (None, None)
        yield gap_schema.GapCauseParameter(
            **key,
            number=number,
            joint=one.joint,
            name=one.name,
            value=one.value,
            unit=one.unit,
            lower=lower,
            upper=upper,
        )


def _changes(said: Document) -> Iterator[OfDiagnosis]:
    """What all causes change together; and each alone, and all without it."""
    shrink = said.shrink
    measures = {
        "torque_rmse": (shrink.torque_rmse, "N m"),
        "power_rmse": (shrink.power_rmse, "W"),
        "energy_error_percent": (shrink.energy_error_percent, "%"),
    }
    for measure, (change, unit) in measures.items():
        if change is not None:
            yield _change(measure, "together", None, change, unit)
    for one in shrink.by_cause:
        measure = f"{one.channel}_rmse"
        for part, left in (("alone", one.rmse_alone), ("without", one.rmse_when_left_out)):
            before, after = _pooled(one.rmse_before), _pooled(left)
            change = Change(before=before, after=after, noise_floor=None, interval95_after=None)
            yield _change(measure, part, one.cause, change, measures[measure][1])


def _change(measure: str, part: str, cause: str | None, change: Change, unit: str) -> OfDiagnosis:
    lower, upper = change.interval95_after or (None, None)
    return gap_schema.GapChange(
        measure=measure,
        part=part,
        place=cause or ALL,
        cause_id=cause,
        before=change.before,
        after=change.after,
        noise_floor=change.noise_floor,
        lower=lower,
        upper=upper,
        unit=unit,
    )


def _pooled(values: Sequence[float]) -> float:
    """Return the root of the mean square over joints."""
    return math.sqrt(sum(value**2 for value in values) / len(values))


def _closing(said: Document) -> Iterator[OfDiagnosis]:
    closed = said.shrink.closed_fraction
    if closed is not None:
        lower, upper = closed.interval95
        yield gap_schema.GapShrinkage(closed_fraction=closed.value, lower=lower, upper=upper)
    for channel, one in said.shrink.yardstick.items():
        yield gap_schema.GapCloseable(
            channel=channel,
            of_what=one.of,
            closed=one.closed,
            closeable=one.closeable,
            by_regression=one.by_regression,
            nameless=one.nameless,
        )
