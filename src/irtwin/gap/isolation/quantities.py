"""The quantities of a cause: its parameters as the catalogue states them, by the final fit."""

from __future__ import annotations

import numpy as np

from irtwin.effects.effect import Quantity, Term, quantity
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.regression.hypotheses import place_of
from irtwin.identification.estimators import Estimate
from irtwin.robot.description import Robot


def quantities(robot: Robot, finding: Finding, one: Cause) -> list[Quantity]:
    """Return a cause's parameters with 95 % intervals of the fit, those of one variant after the other."""
    return [each for number in range(len(one.variants)) for each in of_variant(robot, finding, one, number)]


def of_variant(robot: Robot, finding: Finding, one: Cause, number: int) -> list[Quantity]:
    """Return the parameters of one of a cause's variants, by its number."""
    found, used, variant = finding.estimate, finding.used, one.variants[number]
    known = {
        (effect.id, term.joint, term.name): float(found.values[k])
        for k, (effect, term) in enumerate(finding.system.terms)
        if term.link is None
    }
    places = [used.index(k) for k in variant.columns]
    joint = place_of(variant.terms[0])
    effect = variant.effect.on(joint) if joint is not None and len(one.joints) > 0 else variant.effect
    if len(effect.terms(robot)) != len(places):
        return [_coefficient(term, found, place) for term, place in zip(variant.terms, places, strict=True)]
    covariance = found.covariance[np.ix_(places, places)]
    stated = effect.parameters(robot, found.values[places], covariance, known)
    return [each for each in stated if np.isfinite(each.value)]


def _coefficient(term: Term, found: Estimate, place: int) -> Quantity:
    deviation = float(np.sqrt(max(found.covariance[place, place], 0.0)))
    return quantity(term.name, term.joint, float(found.values[place]), term.unit, deviation)
