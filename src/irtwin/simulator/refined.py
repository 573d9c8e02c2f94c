"""Numbers that differ, fitted together by rollouts of the whole model: one joint's play is another's.

Soft joints are told so, too: the link behind a spring swings the others, and a joint alone shows less. Either number of
a soft joint is tried in place of all that the joint has, as beside these it could be anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from irtwin.effects.effect import NORMAL
from irtwin.identification.progress import tell_step, track
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.equations import Equations
from irtwin.simulator.fit import BY_WHOLE, FARTHEST, LIKELY, STEP, Fit, Played
from irtwin.simulator.servos import NAMES, OF_JOINTS, SOFT

_PASSES, _WORTH = 8, 0.3
_NEAR = 0.2  # of the step of a difference quotient: what falls bends
_OF_LIMIT = ((0.8, 0.9, 0.95, 1.05, 1.1, 1.2), (0.97, 0.985, 1.015, 1.03), (0.993, 1.007))  # each about the last
_LIMIT = NAMES.index("torque_limit")
_SHARES, _DAMPINGS = (1.0, 0.3), (0.0, 1.0)  # of a step, tried
_TRIED = (0.05, 0.2, 0.8)  # of the chart: what is softer than such a number is better with it than without
_NEARER = ((0.5, 0.7, 1.4, 2.0, 2.8), (0.85, 0.93, 1.08, 1.18), (0.96, 0.98, 1.02, 1.04))  # times the best of them
_CLOSES = 0.2  # of what numbers of a joint close, from which a compliance in their place is looked for more closely

Place = tuple[int, int]  # row of a number, and joint


def refined(chosen: DifferingNumbers) -> DifferingNumbers:
    """Return numbers of joints, those that differ fitted together by what the whole model plays.

    What the evidence is no worse without is given back, and all that a joint has beside its limit of torque where that
    explains more alone. Intervals are as wide as these equations say, and no narrower than joints by themselves did.
    """
    fit, best, places = chosen.fit, chosen.fit.rolled(chosen.played.at), _places(chosen)
    for joint in [joint for row, joint in places if row == _LIMIT]:
        best, places = _limit_alone(fit, best, places, joint)
    own = fit.servos.chart(fit.servos.numbers)
    while True:
        best, slopes = _solved(fit, best, places)
        doubt = _likely(fit, best, slopes).variance
        off = np.array([(best.at - own)[place] for place in places])
        loss = off**2 / doubt / 2 - np.log(len(NAMES)) - np.log(_of(LIKELY, places) ** 2 / doubt) / 2
        if not places or loss.min() >= 0:
            break
        place = places.pop(int(np.argmin(loss)))
        best = fit.all_rolled([_moved(best.at, [place], [(own - best.at)[place]])])[0]
    return _about(chosen, best, slopes)


def _limit_alone(fit: Fit, best: Played, places: list[Place], joint: int) -> tuple[Played, list[Place]]:
    """Return numbers, and which differ, where a joint has its limit of torque alone, if that is better.

    An arm that gives way falls by the limit, and many numbers that bend its fall a little stand for one that is near.
    """
    others = [place for place in places if place[1] == joint and place[0] != _LIMIT]
    own = fit.servos.chart(fit.servos.numbers)
    limited = fit.rolled(_moved(best.at, others, [(own - best.at)[place] for place in others]))
    for shares in _OF_LIMIT:
        tried = [fit.servos.of_chart(limited.at) for _ in shares]
        for numbers, share in zip(tried, shares, strict=True):
            numbers[_LIMIT, joint] *= share
        rolled = fit.all_rolled([fit.servos.chart(numbers) for numbers in tried])
        limited = min((limited, *rolled), key=fit.total)
    price = np.log(len(NAMES)) * len(others)
    if not others or fit.total(limited) >= fit.total(best) + price:
        return best, places
    return limited, [place for place in places if place not in others]


def evidence(chosen: DifferingNumbers) -> float:
    """Return how bad numbers are by the whole model, with what those that differ could have been besides."""
    fit, places = chosen.fit, _places(chosen)
    best = fit.rolled(chosen.played.at)
    known = _likely(fit, best, _slopes(fit, best, places)).known(_of(LIKELY, places))
    return fit.total(best) + float(np.log(len(NAMES)) * chosen.differs.sum() + known)


def _places(chosen: DifferingNumbers) -> list[Place]:
    return [(int(row), int(joint)) for row, joint in np.argwhere(chosen.differs) if row in BY_WHOLE]


def _solved(fit: Fit, best: Played, places: Sequence[Place]) -> tuple[Played, Equations]:
    """Return numbers with some fitted, and the slopes there."""
    for number in range(_PASSES):
        slopes = _slopes(fit, best, places)
        equations = _likely(fit, best, slopes)
        steps = [equations.damped(damping).step(_of(FARTHEST, places)) for damping in _DAMPINGS]
        tried = fit.all_rolled([_moved(best.at, places, share * step) for step in steps for share in _SHARES])
        better = min(tried, key=fit.total)
        tell_step(f"  numbers by the whole model, pass {number + 1} of {_PASSES} at most")
        if fit.total(best) - fit.total(better) < _WORTH:
            return best, slopes
        best = better
    return best, _slopes(fit, best, places)


def _of(rows: np.ndarray, places: Sequence[Place]) -> np.ndarray:
    return np.array([rows[row, 0] for row, _ in places])


def _about(chosen: DifferingNumbers, best: Played, equations: Equations) -> DifferingNumbers:
    """Return the numbers, of which some differ, with what slopes (p, D) say of them."""
    count, places = len(equations.right), equations.rows
    servos, differs = chosen.fit.servos, chosen.differs.copy()
    ends = servos.chart(chosen.interval)
    spread = (ends[1] - ends[0]) / (2 * NORMAL)
    differs[list(BY_WHOLE)] = False
    variance = _likely(chosen.fit, best, equations).disagreement(equations.right, len(places))
    for own, place in zip(np.sqrt(variance), places, strict=True):
        differs[place], spread[place] = True, max(spread[place], own)
    spread = np.where(differs, spread, 0.0)
    fit = chosen.fit.about(best.at)
    played = fit.played(best.at)
    shape = (count, differs.shape[1], len(BY_WHOLE))
    slopes = Equations(BY_WHOLE, np.zeros((*shape, len(BY_WHOLE))), np.zeros(shape))
    for joint in range(differs.shape[1]):
        own = equations.some([place for place in places if place[1] == joint])
        at = np.array([BY_WHOLE.index(row) for row, _ in own.rows], dtype=int)
        slopes.right[:, joint, at] = own.right
        slopes.normal[:, joint, at[:, None], at] = own.normal
    interval = np.array([servos.of_chart(best.at + side * spread) for side in (-NORMAL, NORMAL)])
    odds = np.where(differs, chosen.odds, -np.inf)
    return DifferingNumbers(fit, played, slopes, differs, odds, interval)


def _slopes(fit: Fit, best: Played, places: Sequence[Place]) -> Equations:
    """Return each stretch's equations (p, D) of a step of numbers, all joints together."""
    steps = _NEAR * _of(STEP, places)
    moved = fit.all_rolled([_moved(best.at, [place], [step]) for place, step in zip(places, steps, strict=True)])
    return fit.sums(best, places, moved, steps).together(axis=1)


def _likely(fit: Fit, best: Played, slopes: Equations) -> Equations:
    """Return the equations of all stretches, with how likely numbers are before."""
    off = np.array([fit.away(best.at)[place] for place in slopes.rows])
    return slopes.together().likely(off, _of(LIKELY, slopes.rows))


def _moved(at: np.ndarray, places: Sequence[Place], step: Sequence[float] | np.ndarray) -> np.ndarray:
    moved = at.copy()
    for place, own in zip(places, step, strict=True):
        moved[place] += own
    return moved


def softened(chosen: DifferingNumbers) -> DifferingNumbers:
    """Return numbers with the soft joint that explains more than what its joint has otherwise, if any does.

    There, and where a limit of torque differs, numbers are fitted by the whole model: an arm gives way as one.
    """
    tried = _softer(chosen)
    if tried is not None:
        better = refined(tried)
        if evidence(better) < evidence(chosen):
            return better
    return limited(chosen)


def limited(chosen: DifferingNumbers) -> DifferingNumbers:
    """Return numbers, fitted by the whole model where a limit of torque is among them."""
    return refined(chosen) if chosen.differs[_LIMIT].any() else chosen


def _softer(chosen: DifferingNumbers) -> DifferingNumbers | None:
    """Return the numbers with one joint soft that leave least, if they leave less than those that were chosen."""
    fit, own = chosen.fit, chosen.fit.servos.chart(chosen.fit.servos.numbers)
    joints = np.flatnonzero(fit.servos.can_differ[list(SOFT)].any(axis=0)).tolist()
    rigid, price, winner = fit.rolled(chosen.played.at), np.log(len(NAMES)), None
    before = least = fit.total(rigid) + price * chosen.differs.sum()
    for joint in track(joints, lambda joint: f"whether {fit.servos.model.joints[joint]} is soft"):
        differs = chosen.differs.copy()
        differs[: len(OF_JOINTS), joint] = False
        best, row = _best(fit, np.where(differs, chosen.played.at, own), joint, fit.total(rigid))
        cost = fit.total(best) + price * (differs.sum() + 1)
        if cost < least:
            differs[row, joint] = True
            least, winner = cost, (best, differs)
    if winner is None:
        return None
    odds = np.where(winner[1] & ~chosen.differs, before - least, chosen.odds)
    ends = np.where(winner[1] & chosen.differs, chosen.interval, fit.servos.of_chart(winner[0].at))
    return replace(chosen, played=winner[0], differs=winner[1], odds=odds, interval=ends)


def _best(fit: Fit, at: np.ndarray, joint: int, rigid: float) -> tuple[Played, int]:
    """Return the best of numbers with a joint soft, and which row says so; `rigid`: what those that were chosen cost.

    It is looked for more closely where any closes much of what they do.
    """
    best, best_way = fit.rolled(at), (SOFT[0], 0.0)
    enough = _CLOSES * rigid + (1 - _CLOSES) * fit.total(best)
    ways = [(row, value) for row in SOFT for value in _TRIED]
    for factors in (*_NEARER, ()):
        tried = [at.copy() for _ in ways]
        for trial, (row, value) in zip(tried, ways, strict=True):
            trial[row, joint] = value
        pairs = zip((best, *fit.all_rolled(tried)), (best_way, *ways), strict=True)
        best, best_way = min(pairs, key=lambda pair: fit.total(pair[0]))
        if fit.total(best) >= enough:
            break
        ways = [(best_way[0], best_way[1] * factor) for factor in factors]
    return best, best_way[0]
