"""The gap closed: the twin with the causes added."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.effects.effect import Effect
from irtwin.gap.data.case import Case
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.regression.hypotheses import CHANGED
from irtwin.twin.identify import identify
from irtwin.twin.twin import Twin


def closed_twin(case: Case, causes: Sequence[Cause]) -> Twin:
    """Return the twin with the causes added; where some effect changed, fitted to the observed runs alone.

    A changed effect that the twin has needs no second one; a load at the flange is one with the last body.
    """
    added: list[Effect] = []
    for cause in causes:
        if cause.effect in case.effects or (cause.scope == CHANGED and cause.variants[0].effect.within_bodies):
            continue
        for variant in cause.variants:
            joint = variant.terms[0].joint if cause.joints else None
            effect = variant.effect if joint is None else variant.effect.on(joint)
            if not any(one.id == effect.id and one.joints == effect.joints for one in added):
                added.append(effect)
    changed = any(cause.scope == CHANGED for cause in causes)
    robot, motions = case.given
    used = [motion for run, motion in motions.items() if run in case.observed or not changed]
    return identify(robot, used, [*case.effects, *added])
