"""The twin that nobody chose effects for: what data show of the catalogue is chosen, as a diagnosis finds causes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import scipy

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.effect import Effect, force_unit
from irtwin.errors import InputError
from irtwin.gap.closed_twin import added
from irtwin.gap.data.case import Case, case_of
from irtwin.gap.energy_errors import energy_errors
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.regression.held_out import left_out
from irtwin.gap.search import Search, variants
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.two_processes import one_blas_thread
from irtwin.signals.log import DataSet, Run
from irtwin.signals.motion import Motion
from irtwin.twin.identify import identify
from irtwin.twin.twin import Choice, Twin


def begin(runs: Sequence[Run]) -> tuple[str, ...]:
    """Return the effects that need no proof: the baseline's, and the heat of every drive, where power was logged."""
    heat = (one.id for one in catalogue().values() if one.of_every_drive)
    return (*BASELINE, *(heat if any(run.signals.power is not None for run in runs) else ()))


def identified(data_set: DataSet, motions: Sequence[Motion]) -> Twin:
    """Return the twin of a data set's robot, fitted to motions of its runs, conditioned by the data set's cutoff.

    Its effects are those that the data set names; else those that its runs show, each in its shape: all that a twin
    has acts wherever and whenever it moves, so effects about a place, of a while or of the surroundings are left to a
    diagnosis. The scales of power and of torque are told only against each other; the twin's energy is that of the
    meter, so no gain of it is chosen. Where the runs cannot be diagnosed, the effects are those of `begin`. Raises
    InputError where there is nothing to fit.
    """
    if data_set.effects is not None:
        return identify(data_set.robot, motions, data_set.effects)
    begun = begin(data_set.runs)
    runs = tuple(replace(run, role="observed") for run in data_set.runs)
    try:
        effects, choices = _chosen(replace(data_set, runs=runs, effects=begun))
    except InputError:
        effects, choices = begun, ()
    return replace(identify(data_set.robot, motions, effects), choices=choices)


@one_blas_thread()
def _chosen(data_set: DataSet) -> tuple[Sequence[str | Effect], tuple[Choice, ...]]:
    case = case_of(data_set, (), DEFAULT, None)
    found = list(_findings(case))
    causes = [cause for finding in found for cause in finding.causes]
    return (*case.effects, *added(case, causes)), tuple(one for finding in found for one in _choices(case, finding))


def _findings(case: Case) -> Iterator[Finding]:
    """Yield what torque shows, then what power shows on the torque that is explained."""
    search, of_torque = Search(case), None
    floor = search.floor
    tried = _standing(case, "torque"), _standing(case, "power")
    if case.shows("torque"):
        of_torque, floor, _ = search.torque_causes(tried)
        yield of_torque.finding
    if case.shows("power"):
        yield search.power_causes(tried[1], floor, of_torque)[0].finding


def _standing(case: Case, signal: str) -> list[Effect]:
    """Return the shapes of effects on a signal that act wherever and whenever the robot moves."""
    return [
        shape
        for shape in variants(case, signal)
        if not (shape.screened or shape.within_bodies or shape.scales_power or shape.family == "environment")
    ]


def _choices(case: Case, finding: Finding) -> Iterator[Choice]:
    """Yield what a channel shows, then what it leaves open."""
    yield from (_worth(case, finding, cause) for cause in finding.causes)
    open_ones: dict[str, list[tuple[str | None, float]]] = {}
    for one, odds in zip(finding.attribution.hypotheses, finding.attribution.log_odds, strict=True):
        chance = float(scipy.special.expit(odds))
        if one.variants[0].effect.signal == finding.name and chance >= case.thresholds.criterion.unknown:
            open_ones.setdefault(one.effect, []).append((one.joint, chance))
    for effect, places in open_ones.items():
        joints = tuple(joint for joint, _ in places if joint is not None)
        yield Choice(effect, joints, False, max(chance for _, chance in places))


def _worth(case: Case, finding: Finding, cause: Cause) -> Choice:
    """Return what a cause closes beside the others, on groups left out."""
    rest = [k for k in finding.chosen if k not in cause.columns]
    system, noise = finding.system, finding.attribution.noise
    rows = np.maximum(finding.held_out.rows.sum(axis=0), 1)
    left = left_out(system, system.moments(noise), rest, np.flatnonzero(system.group_observed))
    without, beside = (np.sqrt(squares.sum(axis=0) / rows) for squares in (left, finding.held_out.after))
    most = int(np.argmax(without / np.maximum(beside, np.finfo(float).tiny)))
    errors: tuple[float | None, float | None] = (None, None)
    if finding.name == "power":
        errors = energy_errors(finding, case.with_power, rest).mean
    return Choice(
        cause.effect,
        cause.joints,
        chosen=True,
        probability=cause.probability,
        rivals=cause.not_told_from(case.thresholds.criterion.unknown),
        unit="W" if finding.name == "power" else force_unit(case.robot.joints[most]),
        rmse_without=float(without[most]),
        rmse_with=float(beside[most]),
        energy_error_without=errors[0],
        energy_error_with=errors[1],
    )
