"""Which numbers of servos differ from the simulator's: those without whose change the evidence is worse.

Two ways lead there: all numbers are fitted and given back, the least first; and numbers are added to the simulator's,
the most first. The first needs no order in which numbers explain, the second ends in no valley of many numbers that
stand for one. Each joint has the way with more evidence.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from irtwin.effects.effect import NORMAL
from irtwin.gap.thresholds import Criterion
from irtwin.simulator.equations import Equations
from irtwin.simulator.fit import LIKELY, SHARED, SMOOTH, Fit, Played
from irtwin.simulator.servos import HOLDS, NAMES, PARTS, SOFT

_HOLDING = NAMES.index("holding")
_APART = np.isin(np.arange(len(NAMES)), (_HOLDING, *SOFT))[:, None]  # tried by themselves
_ROBOTS = np.isin(np.arange(len(NAMES)), SHARED)[:, None]
_PARTS = {name: np.isin(NAMES, names)[:, None] for name, names in PARTS.items()}
_SHOWS = 1.0  # natural logarithm of odds that one step of a payload or a tilt gains where there is one
_MOST = 1 / Criterion().misfit ** 2  # independent samples that there can be beside what no number names
_AGAIN, _PASSES = 2, 4  # passes after numbers were given back, and when one was added
_FEW = 2  # numbers of a joint that may stand for many
_BEGINS = {"dead_band": (0.003, 0.01), "holding": (HOLDS,)}  # where a number is begun that has no slope at first
_NEARLY = 3.0  # times what a number has to gain, by its slopes: beyond, it is not tried without
_SAME = 1e-9  # of the chart


@dataclass(frozen=True)
class DifferingNumbers:
    """Numbers of the robot and which of them differ: `differs` (k, n); `odds` (k, n), natural logarithms, that they do.

    `interval` (2, k, n): ends of 95 % of each number, the number itself where it is the simulator's.
    """

    fit: Fit
    played: Played
    slopes: Equations
    differs: np.ndarray
    odds: np.ndarray
    interval: np.ndarray

    @property
    def numbers(self) -> np.ndarray:
        """The robot's numbers (k, n)."""
        return self.fit.servos.of_chart(self.played.at)

    @property
    def torque_left(self) -> np.ndarray:
        """What is left of each joint's torque but noise that is new in each sample, (1, n), as a share of it.

        (0, n) where no torque was logged.
        """
        left, logged = (
            [samples[:, 1:] for samples in some]
            for some in (self.played.remainders, [stretch.measured for stretch in self.fit.stretches])
        )
        alike = np.mean([(remainder[1:] * remainder[:-1]).mean(axis=0) for remainder in left], axis=0)
        whole = np.mean([(torque**2).mean(axis=0) for torque in logged], axis=0)
        return np.asarray(np.sqrt(np.maximum(alike, 0.0) / np.maximum(whole, 1e-300)))

    def drawn(self, rng: np.random.Generator) -> np.ndarray:
        """Return numbers (k, n) as they could be: as far off as the intervals say, a joint's together as its errors."""
        ends = self.fit.servos.chart(self.interval)
        spread, at = (ends[1] - ends[0]) / (2 * NORMAL), self.played.at.copy()
        for joint in range(at.shape[1]):
            own = self.fit.equations(self.played.at, self.slopes, self.differs, joint)
            alike = np.linalg.inv(own.normal) / np.sqrt(np.outer(own.variance, own.variance))
            at[own.rows, joint] += spread[own.rows, joint] * rng.multivariate_normal(np.zeros(len(own.rows)), alike)
        at[list(SHARED)] += spread[list(SHARED)] * rng.standard_normal((len(SHARED), 1))
        return self.fit.servos.of_chart(at)

    def without(self, left_out: np.ndarray) -> np.ndarray:
        """Return the numbers (k, n) that fit when stretches (p,) are left out, by one step from those of all."""
        at = self.played.at.copy()
        for joint in range(at.shape[1]):
            own = self.fit.equations(self.played.at, self.slopes, self.differs, joint, ~left_out)
            at[own.rows, joint] += np.clip(own.step(), -0.5, 0.5)
        return self.fit.servos.of_chart(at)


def choose(fit: Fit) -> DifferingNumbers:
    """Return the numbers with most evidence."""
    own = fit.rolled(fit.servos.chart(fit.servos.numbers))
    fit, best = _all_free(fit, own)
    robots = np.zeros((len(NAMES), 1), dtype=bool)
    parts = [part for name, part in _PARTS.items() if name not in fit.servos.trusted]
    for part in parts:
        best, there = _with_part(fit, best, part, robots)
        robots = robots | (part & there)
    fit = _judged(fit, best, own) if robots.any() else fit
    for _ in range(2 if robots.any() else 1):  # what made up for a part of it is given back
        fit, best, differs = _given_back(fit, best)
        best = fit.solved(best, differs | robots, _AGAIN)
    if differs.any():
        fit, best, differs = _better(fit, [(best.at, differs), _added(fit, best.at)])
        fit, best, differs = _given_back(fit, fit.solved(best, differs | robots, _AGAIN))
    odds = np.full(differs.shape, -np.inf)
    for part in (part for part in parts if (part & robots).any()):  # beside few numbers it shows whether it is needed
        back = _without(fit, best, part, differs | robots)
        odds = np.where(part, _odds(fit, (best, differs | robots), (back, differs | (robots & ~part))), odds)
        if odds[part[:, 0], 0][0] <= 0:
            robots = robots & ~part
            fit, best, differs = _given_back(fit, back)  # what made up for it, too
    differs |= robots
    slopes = fit.slopes(best)
    loss, worth = _weighed(fit, best, slopes, differs)
    odds = np.where(differs, np.where(_ROBOTS, odds, loss - worth), -np.inf)
    return DifferingNumbers(fit, best, slopes, differs, odds, _interval(fit, best, slopes, differs))


def _with_part(fit: Fit, best: Played, part: np.ndarray, robots: np.ndarray) -> tuple[Played, bool]:
    """Return numbers with a payload, or a tilt, where it has evidence, and whether it has.

    It is fitted to the model as it is, and beside what explains most without it: either may be in the other's way.
    `part` and `robots` (k, 1): what joints share of it, and of what was found before.
    """
    free, own = _free(fit) | robots, fit.servos.chart(fit.servos.numbers)
    shared, rights = _of_robot(fit, best, free | part)
    pull = rights.sum(axis=0)
    if pull @ replace(shared, right=pull).step() / 2 < _SHOWS:
        return best, False
    begun = (best, fit.played(np.where(robots, best.at, own)))
    alone = np.broadcast_to(part, own.shape)
    first = fit.all_solved([(played, alone) for played in begun], _PASSES)
    with_part = fit.best(fit.all_solved([(played, free | part) for played in first]), together=True)
    back = _without(fit, with_part, part, free | part)
    best = fit.best([best, back], together=bool(robots.any()))  # what came with it may be as good without
    there = _odds(fit, (with_part, free | part), (best, free)) > 0
    return (with_part if there else best), there


def _without(fit: Fit, best: Played, part: np.ndarray, free: np.ndarray) -> Played:
    """Return numbers fitted without a part, of those that are free (k, n)."""
    own = fit.servos.chart(fit.servos.numbers)
    return fit.solved(fit.played(np.where(part, own, best.at)), free & ~part)


def _odds(fit: Fit, with_part: tuple[Played, np.ndarray], without: tuple[Played, np.ndarray]) -> float:
    """Return the odds, natural logarithms, of numbers with a part to those without; each with what is free (k, n)."""
    worth = np.log(len(NAMES)) + _known(fit, *with_part) - _known(fit, *without)
    return float(fit.total(without[0]) - fit.total(with_part[0]) - worth)


def _given_back(fit: Fit, best: Played) -> tuple[Fit, Played, np.ndarray]:
    """Give numbers back to the simulator that the evidence is no worse without, the least first."""
    own = np.where(_ROBOTS, best.at, fit.servos.chart(fit.servos.numbers))
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
            return fit, best, differs
        tried = fit.solved(fit.played(np.where(some, own, best.at)), differs & ~some, _AGAIN)
        given = some & (fit.cost(fit.rolled(tried.at)) - fit.cost(best) < worth)
        differs &= ~given
        needed |= some & ~given
        best = fit.played(np.where(given.any(axis=0), tried.at, best.at))


def _added(fit: Fit, shared_at: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Add to the simulator's numbers of each joint a few of most evidence, beside what joints share at `shared_at`.

    Return where they are, and which differ.
    """
    at = np.where(_ROBOTS, shared_at, fit.servos.chart(fit.servos.numbers))
    differs = np.zeros(at.shape, dtype=bool)
    for _ in range(_FEW):
        fit = fit.about(at)
        best = fit.played(at)
        begun = [_with(fit, best, differs, row) for row in (*SMOOTH, _HOLDING)]
        frees = [more for _, more in begun]
        tried = list(zip(fit.all_solved(begun, _PASSES), frees, strict=True))
        evidence, *evidences = _evidences(fit, [(best, differs), *tried])
        chosen = np.argmin(evidences, axis=0)
        better = np.min(evidences, axis=0) < evidence
        for joint in np.flatnonzero(better):
            winner, more = tried[chosen[joint]]
            at[:, joint], differs[:, joint] = winner.at[:, joint], more[:, joint]
        if not better.any():
            break
    return at, differs


def _with(fit: Fit, best: Played, differs: np.ndarray, row: int) -> tuple[Played, np.ndarray]:
    """Return numbers to begin with where one more of each joint is to be fitted, and which differ then."""
    more = differs.copy()
    more[row] |= fit.servos.can_differ[row]
    begins = [best]
    for value in _BEGINS.get(NAMES[row], ()):
        at = best.at.copy()
        at[row] = np.where(differs[row] | ~more[row], at[row], value)
        begins.append(fit.played(at))
    begun = begins[-1] if row == _HOLDING else fit.best(begins)
    if NAMES[row] == "torque_limit":
        begun = fit.limited(begun)
    if NAMES[row] == "delay":
        begun = fit.delayed(begun)
    return begun, more


def _better(fit: Fit, ways: list[tuple[np.ndarray, np.ndarray]]) -> tuple[Fit, Played, np.ndarray]:
    """Return each joint as the way has it that has more evidence, by the whole model."""
    evidences = []
    for at, differs in ways:
        about = fit.about(at)
        evidences += _evidences(about, [(about.played(at), differs)])
    chosen = np.argmin(evidences, axis=0)
    at, differs = (np.choose(chosen, [way[part] for way in ways]) for part in (0, 1))
    fit = fit.about(at)
    return fit, fit.played(at), differs


def _evidences(fit: Fit, ways: Sequence[tuple[Played, np.ndarray]]) -> list[np.ndarray]:
    """Return of each way how bad numbers (n,) are with what those that differ (k, n) could have been besides."""
    rows = [[row for row in SMOOTH if differs[row].any()] or SMOOTH[:1] for _, differs in ways]
    every = fit.all_slopes([(best, own) for (best, _), own in zip(ways, rows, strict=True)])
    evidences = []
    for (best, differs), slopes in zip(ways, every, strict=True):
        costs: np.ndarray = fit.cost(best) + np.log(len(NAMES)) * differs.sum(axis=0)
        for joint in range(differs.shape[1]):
            equations = fit.equations(best.at, slopes, differs, joint)
            costs[joint] += equations.known(LIKELY[equations.rows, 0])
        evidences.append(costs)
    return evidences


def _all_free(fit: Fit, own: Played) -> tuple[Fit, Played]:
    """Return the fit with what its misfit and certainty are, and all numbers fitted; `own`: the simulator's, played."""
    free, begun = _free(fit), [own, fit.rolled(fit.begun().at)]
    best = fit.best([*begun, *(fit.rolled(fit.delayed(fit.limited(fit.played(start.at))).at) for start in begun)])
    best = fit.solved(fit.played(best.at), free, _PASSES)  # before what is left says how much each channel counts
    for _ in range(2):
        fit = _judged(fit, best, own)
        tried = fit.delayed(fit.limited(fit.played(best.at)))
        fit = fit.about(tried.at)
        best = fit.solved(fit.played(tried.at), free)
    return fit, best


def _judged(fit: Fit, best: Played, own: Played) -> Fit:
    """Return the fit about numbers; the least that they or the simulator's leave is taken for what is left at best."""
    usual = np.sqrt(np.minimum(*(np.median(played.squares, axis=0) for played in (best, own))))
    return replace(fit, floor=np.maximum(usual, fit.least), certainty=certainty(best)).about(best.at)


def _free(fit: Fit) -> np.ndarray:
    """Return the numbers (k, n) that are fitted at once; a soft joint beside many others could be anything."""
    return np.asarray(fit.servos.can_differ & ~_APART)


def certainty(best: Played) -> np.ndarray:
    """Return how many independent samples the remainder of a stretch has, (c, n): the median of all."""
    counts = []
    for left in best.remainders:
        spectrum = np.abs(np.fft.rfft(left, 2 * len(left), axis=0)) ** 2
        correlation = np.fft.irfft(spectrum, 2 * len(left), axis=0)[: len(left)]
        correlation /= np.maximum(correlation[0], 1e-300)
        fallen = np.cumsum(correlation < 0.05, axis=0) > 0
        counts.append(len(left) / (2 * np.where(fallen, 0.0, correlation).sum(axis=0) - 1))
    return np.asarray(np.clip(np.median(counts, axis=0), 1.0, _MOST / len(counts)))


def _weighed(fit: Fit, best: Played, slopes: Equations, differs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return by how much the cost rises (k, n) where a number is given back, and by how much it has to, to differ.

    The latter is what the number could have been besides, and which of all numbers it is.
    """
    own, loss = fit.servos.chart(fit.servos.numbers), np.full(differs.shape, np.inf)
    worth = np.full(differs.shape, np.log(len(NAMES)))
    for joint in range(differs.shape[1]):
        equations = fit.equations(best.at, slopes, differs, joint)
        loss[equations.rows, joint] = (best.at - own)[equations.rows, joint] ** 2 / equations.variance / 2
        worth[equations.rows, joint] += np.log(LIKELY[equations.rows, 0] ** 2 / equations.variance) / 2
    if differs[_HOLDING].any():
        back = best.at.copy()
        back[_HOLDING] = own[_HOLDING]
        loss[_HOLDING] = np.where(differs[_HOLDING], fit.cost(fit.played(back)) - fit.cost(best), np.inf)
    return loss, worth


def _interval(fit: Fit, best: Played, slopes: Equations, differs: np.ndarray) -> np.ndarray:
    """Return the ends of 95 % (2, k, n) of the numbers, by how stretches disagree, and by what is left of each.

    Numbers that were given back may differ all the same: without gravity's load, motion alone says little of the scale
    of stiffness, damping and friction together.
    """
    spread = np.zeros(differs.shape)
    for joint in range(differs.shape[1]):
        own = fit.equations(best.at, slopes, differs, joint)
        rights = slopes.some(own.rows).right[:, joint]
        doubt = _doubt(fit, best, slopes, differs, joint)
        spread[own.rows, joint] = np.sqrt(own.disagreement(rights, len(own.rows)) + doubt)
    shared, rights = _of_robot(fit, best, differs)
    spread[shared.rows] = np.sqrt(shared.disagreement(rights, 1))[:, None]
    return np.array([fit.servos.of_chart(best.at + side * spread) for side in (-NORMAL, NORMAL)])


def _known(fit: Fit, best: Played, free: np.ndarray) -> float:
    """Return how much better than before what joints share is known, of what is free (k, n)."""
    shared, _ = _of_robot(fit, best, free)
    return shared.known(LIKELY[shared.rows, 0])


def _of_robot(fit: Fit, best: Played, free: np.ndarray) -> tuple[Equations, np.ndarray]:
    """Return the equations of rows that joints share and are free (k, n), and each stretch's right side (p, k)."""
    alike = [row for row in SHARED if free[row].any()]
    slopes = fit.slopes(best, (*SMOOTH, *alike))
    marginals, rights = [], []
    for joint in range(free.shape[1]):
        own = fit.equations(best.at, slopes, free, joint)
        marginals.append(own.marginal(alike))
        rights.append(replace(own, right=slopes.some(own.rows).right[:, joint]).marginal(alike).right)
    return Equations.beside(marginals).together(), np.sum(rights, axis=0)


def _doubt(fit: Fit, best: Played, slopes: Equations, differs: np.ndarray, joint: int) -> np.ndarray:
    """Return what a joint's numbers that were given back add to the variance of those that differ.

    Each adds what freeing it would, as likely as the data leave it that it differs.
    """
    before = fit.equations(best.at, slopes, differs, joint)
    doubt = np.zeros(len(before.rows))
    for row in (candidate for candidate in SMOOTH if candidate not in before.rows):
        freed = differs.copy()
        freed[row, joint] = True
        after = fit.equations(best.at, slopes, freed, joint)
        variance, step = after.variance, after.step()
        own, others = after.rows.index(row), [after.rows.index(kept) for kept in before.rows]
        worth = np.log(len(NAMES)) + np.log(LIKELY[row, 0] ** 2 / variance[own]) / 2
        chance = scipy.special.expit(step[own] ** 2 / variance[own] / 2 - worth)
        doubt += chance * (np.maximum(variance[others] - before.variance, 0.0) + step[others] ** 2)
    return doubt
