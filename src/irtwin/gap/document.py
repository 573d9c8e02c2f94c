"""The diagnosis' parts in the form of `diagnosis.schema.json`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from irtwin.effects.effect import Quantity, Term
from irtwin.gap.data.noise_floor import Floor
from irtwin.gap.energy_errors import EnergyErrors
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.confidence import confidence
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.isolation.verdict import UNEXPLAINED
from irtwin.gap.regression.held_out import closed_fraction, held_out, pooled_interval
from irtwin.gap.regression.normal_equations import noise_before
from irtwin.gap.screening.screen import acting
from irtwin.gap.thresholds import Confidence
from irtwin.identification.estimators import Estimate
from irtwin.robot.description import Robot

Json = dict[str, Any]


def gap(joints: Sequence[str], findings: Sequence[Finding], energies: EnergyErrors | None) -> Json:
    """Return the gap before anything is added."""
    document: Json = {"energy_error_percent": energies.mean[0] if energies else None}
    for finding in findings:
        judged = finding.held_out.rows.sum(axis=0)
        numbers = [
            {
                "rmse": float(rmse),
                "noise_floor": None if finding.floor is None else float(finding.floor[k]),
                "excess": None if finding.excess is None or not judged[k] else float(finding.excess[k]),
            }
            for k, rmse in enumerate(finding.rmse)
        ]
        document[finding.name] = dict(zip(joints, numbers, strict=True)) if finding.name == "torque" else numbers[0]
    return document


def cause(
    robot: Robot, finding: Finding, one: Cause, gains: Sequence[float], verdict: str, weights: Confidence
) -> Json:
    """Return a cause with its parameters and evidence; `gains` are those of all causes."""
    closed, share, unexplained = finding.closed(one), min(one.gain / max(gains), 1.0), verdict == UNEXPLAINED
    return {
        "effect": one.effect,
        "joints": acted_on(robot, one),
        "scope": one.scope,
        "confidence": confidence(one.t, one.gain, closed, share, len(gains), weights, unexplained=unexplained),
        "parameters": parameters(robot, finding, one),
        "indistinguishable_from": list(one.rivals),
        "evidence": {
            "channel": finding.name,
            "share_of_what_is_closed": finding.share(one),
            "closed_where_it_acts": closed,
            "gain_on_groups_left_out": one.gain,
            "t_between_groups": one.t,
            "p_adjusted_for_the_catalogue": one.p,
            "gain_of_rivals": one.rival_gains,
            "correlation_with_rivals": one.rival_correlations,
            **_balance(finding, one),
            **acting(one.variants),
        },
    }


def _balance(finding: Finding, one: Cause) -> Json:
    """Return what torque and power together say of a cause."""
    if finding.name == "power":
        electrical = all(variant.effect.channel == "power" for variant in one.variants)
        return {"power_on_explained_torque_says": "electrical" if electrical else "meter"}
    said = finding.balance(one)
    if said is None:
        return {}
    return {
        "power_says": said.kind or "undecided",
        "gain_in_power_if_mechanical": said.gain,
        "t_in_power_between_groups": said.t,
    }


def acted_on(robot: Robot, one: Cause) -> list[str]:
    """Return the joints that a cause acts on; none for an effect of the whole robot."""
    named = [(variant.effect, term.joint) for variant in one.variants for term in variant.terms if term.link is None]
    touched = [effect.touched(robot, joint) for effect, joint in named if joint is not None]
    return list(dict.fromkeys(joint for joints in touched for joint in joints))


def parameters(robot: Robot, finding: Finding, one: Cause) -> list[Json]:
    """Return a cause's parameters as the catalogue states them, with 95 % intervals."""
    found, used = finding.estimate, finding.used
    known = {
        (effect.id, term.joint, term.name): float(found.values[k])
        for k, (effect, term) in enumerate(finding.system.terms)
        if term.link is None
    }
    stated: list[Json] = []
    for variant in one.variants:
        places = [used.index(k) for k in variant.columns]
        joint = variant.terms[0].joint if variant.terms[0].link is None and len(variant.terms) else None
        effect = variant.effect
        if joint is not None and len(one.joints) > 0:
            effect = effect.on(joint)
        if len(effect.terms(robot)) == len(places):
            covariance = found.covariance[np.ix_(places, places)]
            quantities = effect.parameters(robot, found.values[places], covariance, known)
            stated += [_quantity(each) for each in quantities if np.isfinite(each.value)]
        else:
            stated += [_coefficient(variant.terms[k], found, place) for k, place in enumerate(places)]
    if one.of_bodies:  # most of a body's numbers do not show: those that do
        stated = [each for each in stated if each["interval95"] and each["interval95"][0] * each["interval95"][1] > 0]
    return stated


def shrink(
    robot: Robot,
    runs: Sequence[str],
    findings: Sequence[Finding],
    floor: Floor,
    energies: EnergyErrors | None,
    seed: int,
) -> Json:
    """Return how far the gap shrinks on runs that took no part in the fit."""
    document: Json = {
        "held_out_runs": list(runs),
        "noise_floor_from": floor.source,
        "torque_rmse": None,
        "power_rmse": None,
        "energy_error_percent": None,
        "closed_fraction": None,
        "by_cause": [],
    }
    parts = []
    for finding in findings:
        judged = finding.held_out
        rows = judged.rows.sum()
        document[f"{finding.name}_rmse"] = {
            "before": float(np.sqrt(judged.before.sum() / rows)),
            "after": float(np.sqrt(judged.after.sum() / rows)),
            "noise_floor": None if finding.floor is None else float(np.sqrt(np.mean(finding.floor**2))),
            "interval95_after": pooled_interval(judged.after, judged.rows, seed),
        }
        if finding.floor is not None and finding.causes:
            parts.append((judged, finding.floor))
        document["by_cause"] += [_by_cause(robot, finding, one) for one in finding.causes]
    if energies:
        document["energy_error_percent"] = energies.to_json(seed)
    closed = closed_fraction(parts, seed) if parts else None
    if closed:
        document["closed_fraction"] = {"value": closed[0], "interval95": closed[1]}
    return document


def _by_cause(robot: Robot, finding: Finding, one: Cause) -> Json:
    """Return what a cause closes alone, and what is lost without it."""
    system, noise = finding.system, noise_before(finding.system)
    alone = held_out(system, noise, noise, one.columns)
    others = [k for other in finding.causes if other is not one for k in other.columns]
    without = held_out(system, noise, finding.attribution.noise, others)
    return {
        "effect": one.effect,
        "joints": acted_on(robot, one),
        "scope": one.scope,
        "channel": finding.name,
        "share": finding.share(one),
        "rmse_before": [float(value) for value in alone.rmse(alone.before)],
        "rmse_alone": [float(value) for value in alone.rmse(alone.after)],
        "rmse_when_left_out": [float(value) for value in without.rmse(without.after)],
        "rmse_with_all": [float(value) for value in finding.held_out.rmse(finding.held_out.after)],
    }


def _quantity(one: Quantity) -> Json:
    ends = None if one.lower is None or one.upper is None else [one.lower, one.upper]
    return {"name": one.name, "joint": one.joint, "value": one.value, "unit": one.unit, "interval95": ends}


def _coefficient(term: Term, found: Estimate, place: int) -> Json:
    value, half = float(found.values[place]), 1.96 * float(np.sqrt(max(found.covariance[place, place], 0.0)))
    ends = [value - half, value + half]
    return {"name": term.name, "joint": term.joint, "value": value, "unit": term.unit, "interval95": ends}
