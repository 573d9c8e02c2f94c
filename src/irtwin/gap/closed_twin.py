"""The gap closed: the twin with the causes added, and the friction that it has in the joints."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.document.curves import FrictionCurve
from irtwin.effects.effect import Effect
from irtwin.gap.data.case import Case
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.regression.hypotheses import CHANGED, place_of
from irtwin.twin.friction_curve import friction_curves
from irtwin.twin.identify import identify
from irtwin.twin.twin import Twin


def closed_twin(case: Case, causes: Sequence[FoundCause]) -> Twin:
    """Return the twin with the causes added; where some effect changed, fitted to the observed runs alone."""
    changed = any(cause.scope == CHANGED for cause in causes)
    robot, motions = case.given
    used = [motion for run, motion in motions.items() if run in case.observed or not changed]
    return identify(robot, used, [*case.effects, *added(case, causes)], case.prior)


def added(case: Case, causes: Sequence[FoundCause]) -> list[Effect]:
    """Return the effects that causes add to the twin.

    A changed effect that the twin has needs no second one; a load at the flange is one with the last body.
    """
    effects: list[Effect] = []
    for cause in causes:
        if cause.scope == CHANGED and cause.variants[0].effect.within_bodies:
            continue
        for variant in cause.variants:
            joints = dict.fromkeys(map(place_of, variant.terms[:1] if cause.joints else variant.terms))
            lacking = [joint for joint in joints if not {(cause.effect, joint), (cause.effect, None)} & case.modelled]
            named = [joint for joint in lacking if joint is not None]
            whole = not cause.joints and len(lacking) == len(joints)
            effect = variant.effect.standing() if whole else variant.effect.standing().on(*named)
            if lacking and not any(earlier.id == effect.id and earlier.joints == effect.joints for earlier in effects):
                effects.append(effect)
    return effects


def friction(case: Case, causes: Sequence[FoundCause], closed: Twin) -> tuple[FrictionCurve, ...]:
    """Return the friction of each joint by the closed twin; before it, where it changed, as the other runs show it."""
    robot, motions = case.given
    curves = friction_curves(closed, [motions[run] for run in closed.fitted], "observed")
    changed = {
        joint
        for cause in causes
        if cause.scope == CHANGED and cause.variants[0].effect.family == "friction"
        for joint in cause.touched(robot)
    }
    if not changed:
        return curves
    assert case.against is not None
    others = {run: motion for run, motion in motions.items() if run not in case.observed}
    former = identify(robot, list(others.values()), case.effects, case.prior)
    before = friction_curves(former, [others[run] for run in former.fitted], case.against)
    return (*(curve for curve in before if curve.joint in changed), *curves)
