"""The gap closed: the twin with the causes added."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.effects.effect import Effect
from irtwin.gap.data.case import Case
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.regression.hypotheses import CHANGED, place_of
from irtwin.identification.progress import Tell
from irtwin.twin.identify import identify
from irtwin.twin.twin import Twin


def closed_twin(case: Case, causes: Sequence[Cause], tell: Tell | None = None) -> Twin:
    """Return the twin with the causes added; where some effect changed, fitted to the observed runs alone.

    A changed effect that the twin has needs no second one; a load at the flange is one with the last body. `tell` is
    told how far that has come, where it takes long.
    """
    added: list[Effect] = []
    for cause in causes:
        if cause.scope == CHANGED and cause.variants[0].effect.within_bodies:
            continue
        for variant in cause.variants:
            joints = dict.fromkeys(map(place_of, variant.terms[:1] if cause.joints else variant.terms))
            lacking = [joint for joint in joints if not {(cause.effect, joint), (cause.effect, None)} & case.modelled]
            named = [joint for joint in lacking if joint is not None]
            whole = not cause.joints and len(lacking) == len(joints)
            effect = variant.effect.standing() if whole else variant.effect.standing().on(*named)
            if lacking and not any(one.id == effect.id and one.joints == effect.joints for one in added):
                added.append(effect)
    changed = any(cause.scope == CHANGED for cause in causes)
    robot, motions = case.given
    used = [motion for run, motion in motions.items() if run in case.observed or not changed]
    return identify(robot, used, [*case.effects, *added], case.prior, tell)
