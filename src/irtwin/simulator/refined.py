"""Numbers that differ, fitted together by rollouts of the whole model: one joint's play is another's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from irtwin.effects.effect import NORMAL
from irtwin.identification.progress import tell_step
from irtwin.simulator.choice import DifferingNumbers, independent
from irtwin.simulator.equations import Equations
from irtwin.simulator.fit import BY_WHOLE, FARTHEST, LIKELY, STEP, Fit, Played
from irtwin.simulator.servos import NAMES

_PASSES, _WORTH = 8, 0.3
_NEAR = 0.2  # of the step of a difference quotient: what falls bends
_SHARES, _DAMPINGS = (1.0, 0.3), (0.0, 1.0)  # of a step, tried
_UNLIKELY = NORMAL**2 / 2  # natural logarithm by which the evidence is worse at the ends of 95 %
_FARTHER, _WIDER = (1.2, 2.25), 4  # times as far each time that an interval is too narrow, squared; how often

Place = tuple[int, int]  # row of a number, and joint


def refined(chosen: DifferingNumbers) -> DifferingNumbers:
    """Return numbers of joints, those that differ fitted together by what the whole model plays.

    What the evidence is no worse without is given back. Intervals are as wide as these equations say, no narrower than
    joints by themselves did, and wider where the evidence at their ends is not worse by what is unlikely.
    """
    best, places = chosen.fit.rolled(chosen.played.at), _places(chosen)
    own = chosen.fit.servos.chart(chosen.fit.servos.numbers)
    fit = replace(chosen.fit, certainty=np.minimum(chosen.fit.certainty, independent(best)))  # what falls is one swing
    while True:
        best, slopes = _solved(fit, best, places)
        doubt = _likely(fit, best, slopes).variance
        off = np.array([(best.at - own)[place] for place in places])
        loss = off**2 / doubt / 2 - np.log(len(NAMES)) - np.log(_of(LIKELY, places) ** 2 / doubt) / 2
        if places and loss.min() < 0:
            place = places.pop(int(np.argmin(loss)))
            best = fit.all_rolled([_moved(best.at, [place], [(own - best.at)[place]])])[0]
            continue
        better, reach = _reached(fit, best, slopes, NORMAL * _spread(chosen, fit, best, slopes))
        if fit.total(best) - fit.total(better) < _WORTH:
            return _about(chosen, best, slopes, reach)
        best = better


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
        before, best = fit.total(best), min((best, *tried), key=fit.total)
        tell_step(f"  numbers by the whole model, pass {number + 1} of {_PASSES} at most")
        if before - fit.total(best) < _WORTH:
            break
    return best, slopes


def _of(rows: np.ndarray, places: Sequence[Place]) -> np.ndarray:
    return np.array([rows[row, 0] for row, _ in places])


def _reached(fit: Fit, best: Played, slopes: Equations, reach: np.ndarray) -> tuple[Played, np.ndarray]:
    """Return the best of numbers about the best, and how far each can be off (2, D) to either side.

    Each number is held off while the others go with it as slopes say, farther until the evidence is worse by what is
    unlikely: where an arm gives way, slopes at the best alone say too much. `reach` (D,): how far at first.
    """
    inverse = np.linalg.inv(_likely(fit, best, slopes).normal)
    beside: np.ndarray = (inverse / np.diag(inverse)).T
    ends = np.outer([-1.0, 1.0], reach)
    found, short = best, list(np.ndindex(ends.shape))
    for _ in range(_WIDER):
        tried = fit.all_rolled([_moved(best.at, slopes.rows, ends[end] * beside[end[1]]) for end in short])
        found = min((found, *tried), key=fit.total)
        worse = {end: fit.total(one) - fit.total(best) for end, one in zip(short, tried, strict=True)}
        short = [end for end, rise in worse.items() if rise < _UNLIKELY]
        for end in short:
            ends[end] *= np.sqrt(np.clip(_UNLIKELY / max(worse[end], 1e-9), *_FARTHER))
        if not short or fit.total(best) - fit.total(found) >= _WORTH:
            break
    return found, ends


def _spread(chosen: DifferingNumbers, fit: Fit, best: Played, slopes: Equations) -> np.ndarray:
    """Return the standard deviations (D,) of numbers by slopes, no less than were chosen."""
    ends = chosen.fit.servos.chart(chosen.interval)
    before = [(ends[1] - ends[0])[place] / (2 * NORMAL) for place in slopes.rows]
    own = _likely(fit, best, slopes).disagreement(slopes.right, len(before))
    return np.asarray(np.maximum(before, np.sqrt(own)))


def _about(chosen: DifferingNumbers, best: Played, found: Equations, reach: np.ndarray) -> DifferingNumbers:
    """Return the numbers, of which some differ, with what slopes (p, D) say of them and how far they `reach` (2, D)."""
    count, places = len(found.right), found.rows
    servos, differs = chosen.fit.servos, chosen.differs.copy()
    ends = servos.chart(chosen.interval) - servos.chart(chosen.numbers)
    differs[list(BY_WHOLE)] = False
    for one, place in enumerate(places):
        differs[place], ends[(slice(None), *place)] = True, reach[:, one]
    ends = np.where(differs, ends, 0.0)
    fit = chosen.fit.about(best.at)
    played = fit.played(best.at)
    shape = (count, differs.shape[1], len(BY_WHOLE))
    slopes = Equations(BY_WHOLE, np.zeros((*shape, len(BY_WHOLE))), np.zeros(shape))
    for joint in range(differs.shape[1]):
        own = found.some([place for place in places if place[1] == joint])
        at = np.array([BY_WHOLE.index(row) for row, _ in own.rows], dtype=int)
        slopes.right[:, joint, at] = own.right
        slopes.normal[:, joint, at[:, None], at] = own.normal
    interval = servos.of_chart(best.at + ends)
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
    found = at.copy()
    for place, own in zip(places, step, strict=True):
        found[place] += own
    return found
