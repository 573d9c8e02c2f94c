"""Which numbers of servos differ from the simulator's: those without whose change the evidence is worse."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import expit

from irtwin.effects.effect import NORMAL
from irtwin.gap.thresholds import Criterion
from irtwin.simulator.fit import LIKELY, SMOOTH, Fit, Played, Slopes
from irtwin.simulator.servos import NAMES

_HOLDING = NAMES.index("holding")
_LEAST = 2e-3  # rad (m), a misfit that is none
_MOST = 1 / Criterion().misfit ** 2  # independent samples that there can be beside what no number names
_AGAIN = 2  # passes after numbers were given back
_NEARLY = 3.0  # times what a number has to gain, by its slopes: beyond, it is not tried without
_SAME = 1e-9  # of the chart


@dataclass(frozen=True)
class Choice:
    """Numbers of the robot and which of them differ: `differs` (9, n); `odds` (9, n), natural logarithms, that they do.

    `interval` (2, 9, n): ends of 95 % of each number, the number itself where it is the simulator's.
    """

    fit: Fit
    played: Played
    slopes: Slopes
    differs: np.ndarray
    odds: np.ndarray
    interval: np.ndarray

    @property
    def numbers(self) -> np.ndarray:
        """The robot's numbers (9, n)."""
        return self.fit.servos.of_chart(self.played.at)

    def without(self, left_out: np.ndarray) -> np.ndarray:
        """Return the numbers (9, n) that fit when stretches (p,) are left out, by one step from those of all."""
        at = self.played.at.copy()
        for joint in range(at.shape[1]):
            rows, normal, right = _equations(self.fit, self.played, self.slopes, self.differs, joint, ~left_out)
            at[rows, joint] += np.clip(np.linalg.solve(normal, right), -0.5, 0.5)
        return self.fit.servos.of_chart(at)


def choose(fit: Fit) -> Choice:
    """Fit all numbers, then give back to the simulator what the evidence is no worse without, the least first."""
    fit, best = _all_free(fit)
    own = fit.servos.chart(fit.servos.numbers)
    differs = ~np.isclose(best.at, own, rtol=0, atol=_SAME)
    needed = np.zeros_like(differs)
    while True:
        fit = fit.about(best.at)
        best = fit.played(best.at)
        loss, worth = _weighed(fit, best, fit.slopes(best), differs)
        loss[needed] = np.inf
        weakest = np.arange(len(NAMES))[:, None] == np.argmin(loss - worth, axis=0)
        some = weakest & (loss < _NEARLY * worth)
        if not some.any():
            break
        tried = fit.solved(fit.played(np.where(some, own, best.at)), differs & ~some, _AGAIN)
        given = some & (fit.cost(fit.rolled(tried.at)) - fit.cost(best) < worth)
        differs &= ~given
        needed |= some & ~given
        best = fit.played(np.where(given.any(axis=0), tried.at, best.at))
    best = fit.solved(best, differs, _AGAIN)
    slopes = fit.slopes(best)
    loss, worth = _weighed(fit, best, slopes, differs)
    return Choice(
        fit, best, slopes, differs, np.where(differs, loss - worth, -np.inf), _interval(fit, best, slopes, differs)
    )


def _all_free(fit: Fit) -> tuple[Fit, Played]:
    """Return the fit with what its misfit and certainty are, and all numbers fitted."""
    free = np.isin(np.arange(len(NAMES)), SMOOTH)[:, None] & fit.servos.can_differ
    best = fit.begun()
    for _ in range(2):
        usual = np.sqrt(np.median(best.squares, axis=0))
        fit = replace(fit, floor=np.maximum(usual, _LEAST), certainty=_certainty(best)).about(best.at)
        best = fit.solved(fit.limited(fit.played(best.at)), free)
    return fit, best


def _certainty(best: Played) -> np.ndarray:
    """Return how many independent samples the remainder of a stretch has, (n,): the median of all."""
    counts = []
    for left in best.remainders:
        spectrum = np.abs(np.fft.rfft(left, 2 * len(left), axis=0)) ** 2
        correlation = np.fft.irfft(spectrum, 2 * len(left), axis=0)[: len(left)]
        correlation /= np.maximum(correlation[0], 1e-300)
        fallen = np.cumsum(correlation < 0.05, axis=0) > 0
        counts.append(len(left) / (2 * np.where(fallen, 0.0, correlation).sum(axis=0) - 1))
    return np.asarray(np.clip(np.median(counts, axis=0), 1.0, _MOST / len(counts)))


def _weighed(fit: Fit, best: Played, slopes: Slopes, differs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much the cost rises (9, n) where a number is given back, and by how much it has to, to differ.

    The latter is what the number could have been besides, and which of all numbers it is.
    """
    own, loss = fit.servos.chart(fit.servos.numbers), np.full(differs.shape, np.inf)
    worth = np.full(differs.shape, np.log(len(NAMES)))
    for joint in range(differs.shape[1]):
        rows, normal, _ = _equations(fit, best, slopes, differs, joint)
        variance = np.diag(np.linalg.inv(normal))
        loss[rows, joint] = (best.at - own)[rows, joint] ** 2 / variance / 2
        worth[rows, joint] += np.log(LIKELY[rows, 0] ** 2 / variance) / 2
    if differs[_HOLDING].any():
        back = best.at.copy()
        back[_HOLDING] = own[_HOLDING]
        loss[_HOLDING] = np.where(differs[_HOLDING], fit.cost(fit.played(back)) - fit.cost(best), np.inf)
    return loss, worth


def _interval(fit: Fit, best: Played, slopes: Slopes, differs: np.ndarray) -> np.ndarray:
    """Return the ends of 95 % (2, 9, n) of the numbers, by how stretches disagree, and by what is left of each.

    Numbers that were given back may differ all the same: without gravity's load, motion alone says little of the scale
    of stiffness, damping and friction together.
    """
    spread = np.zeros(differs.shape)
    count = len(fit.stretches)
    for joint in range(differs.shape[1]):
        rows, normal, _ = _equations(fit, best, slopes, differs, joint)
        inverse = np.linalg.inv(normal)
        each = slopes.right[:, joint][:, [SMOOTH.index(row) for row in rows]]
        between = inverse @ (each.T @ each) @ inverse * count / max(count - len(rows), 1)
        doubt = _doubt(fit, best, slopes, differs, joint)
        spread[rows, joint] = np.sqrt(np.maximum(np.diag(between), np.diag(inverse)) + doubt)
    return np.array([fit.servos.of_chart(best.at + side * spread) for side in (-NORMAL, NORMAL)])


def _doubt(fit: Fit, best: Played, slopes: Slopes, differs: np.ndarray, joint: int) -> np.ndarray:
    """Return what a joint's numbers that were given back add to the variance of those that differ.

    Each adds what freeing it would, as likely as the data leave it that it differs.
    """
    rows, normal, _ = _equations(fit, best, slopes, differs, joint)
    before, found = np.diag(np.linalg.inv(normal)), np.zeros(len(rows))
    for row in (one for one in SMOOTH if one not in rows):
        freed = differs.copy()
        freed[row, joint] = True
        some, normal, right = _equations(fit, best, slopes, freed, joint)
        variance, step = np.diag(np.linalg.inv(normal)), np.linalg.solve(normal, right)
        own, others = some.index(row), [some.index(one) for one in rows]
        worth = np.log(len(NAMES)) + np.log(LIKELY[row, 0] ** 2 / variance[own]) / 2
        chance = expit(step[own] ** 2 / variance[own] / 2 - worth)
        found += chance * (np.maximum(variance[others] - before, 0.0) + step[others] ** 2)
    return found


def _equations(
    fit: Fit, best: Played, slopes: Slopes, differs: np.ndarray, joint: int, chosen: np.ndarray | slice = slice(None)
) -> tuple[list[int], np.ndarray, np.ndarray]:
    """Return a joint's numbers that differ and are smooth, and the normal equations of a step from them."""
    rows = [row for row in SMOOTH if differs[row, joint]]
    own = [SMOOTH.index(row) for row in rows]
    likely = LIKELY[rows, 0]
    normal = slopes.normal[chosen, joint].sum(axis=0)[np.ix_(own, own)] + np.diag(likely**-2.0)
    right = slopes.right[chosen, joint].sum(axis=0)[own] - fit.away(best.at)[rows, joint] / likely
    return rows, normal, right
