"""The provider of what a saving action saved: measured energy after its day beside a baseline of the runs before it.

Measurement and verification as ISO 50015 and IPMVP (options B and C) ask: the model is the energy for each piece,
cycle or hour before the change, adjusted to the pieces, cycles or hours after it, product by product and payload by
payload.
"""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import scipy
from sqlalchemy import select
from sqlalchemy.orm import Session

from irtwin.knowledge.vocabulary import IRT
from irtwin.providers.names import run_iri
from irtwin.providers.provider import Made
from irtwin.storage.asserted import AssertedFact
from irtwin.storage.database import Workspace
from irtwin.storage.energy_schema import SavingVerification
from irtwin.storage.schema import Activity, RunEnergy, RunRow, in_utc

FEWEST = 3  # runs of a product and payload on each side: with two, nothing tells scatter from change
_SURE = 0.975  # of a distribution below the upper end of a 95 % interval
_BASES = (("pieces", "piece"), ("cycles", "cycle"), ("time_s", "hour"))  # the first that all runs say counts
_HOUR = 3600.0  # s
_DONE_ON, _SAVES_AT = f"{IRT}Done_On", f"{IRT}saves_at"


@dataclass(frozen=True)
class TakenEnergy:
    """What a run took by the meter, on which day (ISO 8601), and what it made; None where nobody said."""

    day: str
    energy_j: float
    time_s: float
    pieces: int | None = None
    cycles: int | None = None
    product: str | None = None
    payload_kg: float | None = None


def provide(workspace: Workspace, action: str) -> Made:
    """Make what an action saved, by its IRI below the base; nothing where what was done is taken back.

    All runs of its robot are read, and all that users assert of these and of actions at it.
    """
    iri = action if ":" in action else workspace.base + action
    with workspace.reading() as session:
        facts = session.scalars(select(AssertedFact).where(AssertedFact.predicate.in_((_DONE_ON, _SAVES_AT)))).all()
        robots = {of.subject: of.about_robot or str(of.value).rpartition("/")[2] for of in facts}
        robot_id = robots.get(iri) or _earlier(session, action)
        here = {subject for subject, robot in robots.items() if robot == robot_id}
        of_robot = AssertedFact.subject.in_(here) | (AssertedFact.about_robot == robot_id)
        used = [f"asserted_fact/{fact_id}" for fact_id in session.scalars(select(AssertedFact.fact_id).where(of_robot))]
        runs = _runs(session, robot_id)
    days = {of.subject: str(of.value) for of in facts if of.predicate == _DONE_ON and of.subject in here}
    used += map(run_iri, runs)
    if iri not in days:
        return Made(robot_id, used, [])
    before = max((day for day in days.values() if day < days[iri]), default="")
    until = min((day for day in days.values() if day > days[iri]), default="~")
    counted = [run for run in runs.values() if run is not None]
    row = verification(counted, days[iri], before, until)
    row.action, row.robot_id = iri, robot_id
    return Made(robot_id, used, [row])


def _earlier(session: Session, action: str) -> str:
    """Return the robot that an action was at when this provider was asked before."""
    of_action = Activity.provider == "verification", Activity.subject == action
    return session.scalars(select(Activity.robot_id).where(*of_action)).one()


def _runs(session: Session, robot_id: str) -> dict[str, TakenEnergy | None]:
    """Return the runs of a robot that are over, by run_id; None of one whose energy or day nobody measured."""
    of_robot = RunRow.robot_id == robot_id, RunRow.ended.is_not(None), RunEnergy.energy_consumption_j.is_not(None)
    rows = session.execute(
        select(RunRow, RunEnergy).join(RunEnergy, RunEnergy.run_id == RunRow.run_id).where(*of_robot)
    )
    return {run.run_id: _taken(run, energy) for run, energy in rows}


def _taken(run: RunRow, energy: RunEnergy) -> TakenEnergy | None:
    if energy.energy_from != "measured" or run.start_time_from != "log" or not run.run_time_s:
        return None
    assert run.start_time is not None and energy.energy_consumption_j is not None
    day = in_utc(run.start_time).date().isoformat()
    made = run.pieces, run.cycles, run.product, run.payload_kg
    return TakenEnergy(day, energy.energy_consumption_j, run.run_time_s, *made)


def verification(runs: Iterable[TakenEnergy], day: str, after: str = "", until: str = "~") -> SavingVerification:
    """Hold the runs before a day against those after it; of the day itself neither, for nobody knows its hour.

    The row says what was saved, J, with its 95 % interval; its action and robot are for who asks to say. Only runs
    after the day `after` and before `until` count, between which nothing else was changed. Products and payloads that
    either side has fewer than FEWEST runs of are left out.
    """
    counted = [run for run in runs if after < run.day < until and run.day != day]
    alike: dict[object, tuple[list[TakenEnergy], list[TakenEnergy]]] = defaultdict(lambda: ([], []))
    for run in counted:
        alike[run.product, run.payload_kg][run.day > day].append(run)
    pairs = [sides for sides in alike.values() if min(map(len, sides)) >= FEWEST]
    if not pairs:
        late = sum(run.day > day for run in counted)
        return SavingVerification(result="too few runs", runs_before=len(counted) - late, runs_after=late)
    unit, amount = _basis([run for sides in pairs for side in sides for run in side])
    return _compared(pairs, unit, amount)


def _basis(runs: Sequence[TakenEnergy]) -> tuple[str, Callable[[TakenEnergy], float]]:
    """Return what energy is compared for, and how much of it a run has."""
    name, unit = next(basis for basis in _BASES if all((getattr(run, basis[0]) or 0.0) > 0.0 for run in runs))
    return unit, lambda run: float(getattr(run, name)) / (_HOUR if name == "time_s" else 1.0)


def _compared(
    pairs: Sequence[tuple[list[TakenEnergy], list[TakenEnergy]]], unit: str, amount: Callable[[TakenEnergy], float]
) -> SavingVerification:
    """Add up what each product and payload saved; the interval is Student's, with Welch's degrees of freedom."""
    adjusted = saved = variance = spread = 0.0
    for before, after in pairs:
        made = sum(map(amount, after))
        rate, unsure, freedom = _rate(before, amount)
        new_rate, new_unsure, new_freedom = _rate(after, amount)
        adjusted += made * rate
        saved += made * (rate - new_rate)
        for part, of in ((made**2 * unsure, freedom), (made**2 * new_unsure, new_freedom)):
            variance += part
            spread += part**2 / of
    half = float(scipy.special.stdtrit(variance**2 / spread, _SURE)) * math.sqrt(variance) if spread else 0.0
    early, late = (sum(len(sides[side]) for sides in pairs) for side in (0, 1))
    return SavingVerification(
        result="verified" if saved - half > 0.0 else "not verified",
        runs_before=early,
        runs_after=late,
        compared_for=unit,
        adjusted_baseline_j=adjusted,
        saving_j=saved,
        saving_lower_j=saved - half,
        saving_upper_j=saved + half,
    )


def _rate(runs: Sequence[TakenEnergy], amount: Callable[[TakenEnergy], float]) -> tuple[float, float, int]:
    """Return the energy of a unit of what runs made, its variance, and the degrees of freedom of that.

    A run's scatter grows with the root of what it made, as a sum's does.
    """
    total = sum(map(amount, runs))
    rate = sum(run.energy_j for run in runs) / total
    squares = sum((run.energy_j - rate * amount(run)) ** 2 / amount(run) for run in runs)
    freedom = len(runs) - 1
    return rate, squares / freedom / total, freedom
