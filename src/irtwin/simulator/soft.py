"""Soft joints, told by the whole model: the link behind a spring swings the others, too, and a joint alone shows less.

Either number of a soft joint is tried in place of all that the joint has, as beside these it could be anything.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from irtwin.identification.progress import track
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.refined import evidence, refined
from irtwin.simulator.servos import NAMES, OF_JOINTS, SOFT

_FEW = 4  # numbers of a joint that may stand for a soft one
_TRIED = (0.03, 0.1, 0.3, 1.0)  # of the chart: what is softer than such a number is better with it than without
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
    few = chosen.differs[: len(OF_JOINTS)].sum(axis=0) <= _FEW
    joints = np.flatnonzero(few & fit.servos.can_differ[list(SOFT)].any(axis=0))
    price, best, found = np.log(len(NAMES)), np.inf, None
    for joint in track(joints.tolist(), lambda one: f"whether {fit.servos.model.joints[one]} is soft"):
        differs = chosen.differs.copy()
        differs[: len(OF_JOINTS), joint] = False
        at = np.where(differs, chosen.played.at, own)
        ways = [(row, value) for row in SOFT for value in _TRIED]
        played = fit.all_rolled([_with(at, row, joint, value) for row, value in ways])
        costs = [fit.cost(one).sum() + price * (differs.sum() + 1) for one in played]
        at_best = int(np.argmin(costs))
        if costs[at_best] < best:
            differs[ways[at_best][0], joint] = True
            best, found = costs[at_best], (played[at_best], differs)
    before = fit.cost(fit.rolled(chosen.played.at)).sum() + price * chosen.differs.sum()
    if found is None or best >= before:
        return None
    odds = np.where(found[1] & ~chosen.differs, before - best, chosen.odds)
    ends = np.where(found[1] & chosen.differs, chosen.interval, fit.servos.of_chart(found[0].at))
    return replace(chosen, played=found[0], differs=found[1], odds=odds, interval=ends)


def _with(at: np.ndarray, row: int, joint: int, value: float) -> np.ndarray:
    found = at.copy()
    found[row, joint] = value
    return found
