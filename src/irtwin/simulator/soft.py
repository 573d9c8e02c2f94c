"""Soft joints, told by the whole model: the link behind a spring swings the others, too, and a joint alone shows less.

Either number of a soft joint is tried in place of all that the joint has, as beside these it could be anything.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from irtwin.identification.progress import track
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.fit import Fit, Played
from irtwin.simulator.refined import evidence, refined
from irtwin.simulator.servos import NAMES, OF_JOINTS, SOFT

_TRIED = (0.05, 0.2, 0.8)  # of the chart: what is softer than such a number is better with it than without
_NEARER = ((0.5, 0.7, 1.4, 2.0), (0.85, 0.93, 1.08, 1.18))  # times the best of them
_CLOSES = 0.2  # of what numbers of a joint close, from which a compliance in their place is looked for more closely
_LIMIT = NAMES.index("torque_limit")


def softened(chosen: DifferingNumbers) -> DifferingNumbers:
    """Return numbers with the soft joint that explains more than what its joint has otherwise, if any does.

    There, and where a limit of torque differs, numbers are fitted by the whole model: an arm gives way as one.
    """
    tried = _softer(chosen)
    if tried is not None:
        better = refined(tried)
        if evidence(better) < evidence(chosen):
            return better
    return refined(chosen) if chosen.differs[_LIMIT].any() else chosen


def _softer(chosen: DifferingNumbers) -> DifferingNumbers | None:
    """Return the numbers with one joint soft that leave least, if they leave less than those that were chosen."""
    fit, own = chosen.fit, chosen.fit.servos.chart(chosen.fit.servos.numbers)
    joints = np.flatnonzero(fit.servos.can_differ[list(SOFT)].any(axis=0)).tolist()
    rigid, price, found = fit.rolled(chosen.played.at), np.log(len(NAMES)), None
    before = least = fit.total(rigid) + price * chosen.differs.sum()
    for joint in track(joints, lambda one: f"whether {fit.servos.model.joints[one]} is soft"):
        differs = chosen.differs.copy()
        differs[: len(OF_JOINTS), joint] = False
        best, row = _best(fit, np.where(differs, chosen.played.at, own), joint, fit.total(rigid))
        cost = fit.total(best) + price * (differs.sum() + 1)
        if cost < least:
            differs[row, joint] = True
            least, found = cost, (best, differs)
    if found is None:
        return None
    odds = np.where(found[1] & ~chosen.differs, before - least, chosen.odds)
    ends = np.where(found[1] & chosen.differs, chosen.interval, fit.servos.of_chart(found[0].at))
    return replace(chosen, played=found[0], differs=found[1], odds=odds, interval=ends)


def _best(fit: Fit, at: np.ndarray, joint: int, rigid: float) -> tuple[Played, int]:
    """Return the best of numbers with a joint soft, and which row says so; `rigid`: what those that were chosen cost.

    It is looked for more closely where any closes much of what they do.
    """
    best, found = fit.rolled(at), (SOFT[0], 0.0)
    enough = _CLOSES * rigid + (1 - _CLOSES) * fit.total(best)
    ways = [(row, value) for row in SOFT for value in _TRIED]
    for factors in (*_NEARER, ()):
        tried = [at.copy() for _ in ways]
        for one, (row, value) in zip(tried, ways, strict=True):
            one[row, joint] = value
        pairs = zip((best, *fit.all_rolled(tried)), (found, *ways), strict=True)
        best, found = min(pairs, key=lambda pair: fit.total(pair[0]))
        if fit.total(best) >= enough:
            break
        ways = [(found[0], found[1] * factor) for factor in factors]
    return best, found[0]
