"""Numbers that differ, fitted together by rollouts of the whole model: one joint's play is another's."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.effects.effect import NORMAL
from irtwin.identification.progress import tell_step
from irtwin.simulator.choice import DifferingNumbers, variance
from irtwin.simulator.fit import BY_WHOLE, LIKELY, STEP, Fit, Played, Slopes, no_farther
from irtwin.simulator.servos import NAMES

_PASSES, _WORTH = 8, 0.3
_NEAR = 0.2  # of the step of a difference quotient: what falls bends
_SHARES, _DAMPINGS = (1.0, 0.3), (0.0, 1.0)  # of a step, tried

Place = tuple[int, int]  # row of a number, and joint


def refined(chosen: DifferingNumbers) -> DifferingNumbers:
    """Return numbers of joints, those that differ fitted together by what the whole model plays.

    What the evidence is no worse without is given back. Intervals are as wide as these equations say, and no narrower
    than joints by themselves did.
    """
    fit, best, own = chosen.fit, chosen.fit.rolled(chosen.played.at), chosen.fit.servos.chart(chosen.fit.servos.numbers)
    places = _places(chosen)
    while True:
        best, normal, each = _solved(fit, best, places)
        doubt = np.diag(np.linalg.inv(normal.sum(axis=0)))
        off = np.array([(best.at - own)[place] for place in places])
        loss = off**2 / doubt / 2 - np.log(len(NAMES)) - np.log(_of(LIKELY, places) ** 2 / doubt) / 2
        if not places or loss.min() >= 0:
            break
        place = places.pop(int(np.argmin(loss)))
        best = fit.all_rolled([_moved(best.at, [place], [(own - best.at)[place]])])[0]
    return _about(chosen, best, places, normal, each)


def evidence(chosen: DifferingNumbers) -> float:
    """Return how bad numbers are by the whole model, with what those that differ could have been besides."""
    fit, places = chosen.fit, _places(chosen)
    best = fit.rolled(chosen.played.at)
    likely = _of(LIKELY, places)
    known = np.linalg.slogdet(_equations(fit, best, places)[0].sum(axis=0) * likely * likely[:, None])[1] / 2
    return fit.total(best) + float(np.log(len(NAMES)) * chosen.differs.sum() + known)


def _places(chosen: DifferingNumbers) -> list[Place]:
    return [(int(row), int(joint)) for row, joint in np.argwhere(chosen.differs) if row in BY_WHOLE]


def _solved(fit: Fit, best: Played, places: Sequence[Place]) -> tuple[Played, np.ndarray, np.ndarray]:
    """Return numbers with some fitted, and the equations of a step from there."""
    for number in range(_PASSES):
        normal, each = _equations(fit, best, places)
        steps = [_step(normal.sum(axis=0), each.sum(axis=0), damping, places) for damping in _DAMPINGS]
        tried = fit.all_rolled([_moved(best.at, places, share * step) for step in steps for share in _SHARES])
        better = min(tried, key=fit.total)
        tell_step(f"  numbers by the whole model, pass {number + 1} of {_PASSES} at most")
        if fit.total(best) - fit.total(better) < _WORTH:
            return best, normal, each
        best = better
    return best, *_equations(fit, best, places)


def _of(rows: np.ndarray, places: Sequence[Place]) -> np.ndarray:
    return np.array([rows[row, 0] for row, _ in places])


def _about(
    chosen: DifferingNumbers, best: Played, places: Sequence[Place], normal: np.ndarray, each: np.ndarray
) -> DifferingNumbers:
    """Return the numbers, of which some differ, with what these equations say of them."""
    count = len(each)
    servos, differs = chosen.fit.servos, chosen.differs.copy()
    ends = servos.chart(chosen.interval)
    spread = (ends[1] - ends[0]) / (2 * NORMAL)
    differs[list(BY_WHOLE)] = False
    for own, place in zip(np.sqrt(variance(normal.sum(axis=0), each, len(places))), places, strict=True):
        differs[place], spread[place] = True, max(spread[place], own)
    spread = np.where(differs, spread, 0.0)
    fit = chosen.fit.about(best.at)
    played = fit.played(best.at)
    shape = (count, differs.shape[1], len(BY_WHOLE))
    slopes = Slopes(np.zeros((*shape, len(BY_WHOLE))), np.zeros(shape))
    for one, (row, joint) in enumerate(places):
        slopes.right[:, joint, BY_WHOLE.index(row)] = each[:, one] + _prior(fit, best, places)[one] / count
        for other, (beside, at) in enumerate(places):
            if at == joint:
                slopes.normal[:, joint, BY_WHOLE.index(row), BY_WHOLE.index(beside)] = normal[:, one, other]
    interval = np.array([servos.of_chart(best.at + side * spread) for side in (-NORMAL, NORMAL)])
    odds = np.where(differs, chosen.odds, -np.inf)
    return DifferingNumbers(fit, played, slopes, differs, odds, interval)


def _equations(fit: Fit, best: Played, places: Sequence[Place]) -> tuple[np.ndarray, np.ndarray]:
    """Return each stretch's normal equations (p, D, D) of a step of numbers, and right side (p, D)."""
    steps, likely = _NEAR * _of(STEP, places), _of(LIKELY, places)
    moved = fit.all_rolled([_moved(best.at, [place], [step]) for place, step in zip(places, steps, strict=True)])
    normal, right, count = [], [], len(fit.stretches)
    for place, left in enumerate(best.remainders):
        columns = np.array([left - one.remainders[place] for one in moved]).reshape(-1, *left.shape)
        columns /= steps[:, None, None, None]
        weight = fit.certainty / (len(left) * (best.squares[place] + fit.floor**2))
        normal.append(np.einsum("dtcn,etcn,cn->de", columns, columns, weight, optimize=True))
        right.append(np.einsum("dtcn,tcn,cn->d", columns, left, weight, optimize=True))
    return np.array(normal) + np.diag(likely**-2.0) / count, np.array(right) - _prior(fit, best, places) / count


def _prior(fit: Fit, best: Played, places: Sequence[Place]) -> np.ndarray:
    return np.asarray([fit.away(best.at)[place] for place in places] / _of(LIKELY, places))


def _step(normal: np.ndarray, right: np.ndarray, damping: float, places: Sequence[Place]) -> np.ndarray:
    step = np.linalg.solve(normal + damping * np.diag(np.diag(normal)), right)
    return no_farther(step, [row for row, _ in places])


def _moved(at: np.ndarray, places: Sequence[Place], step: Sequence[float] | np.ndarray) -> np.ndarray:
    found = at.copy()
    for place, own in zip(places, step, strict=True):
        found[place] += own
    return found
