"""Whether causes repeat: whether halves of the time, each by itself, give a cause the same size.

Where runs are few, groups left out are stretches of a run, between stretches that lack the same as they do. A cause may
then make up for what is otherwise now than later, and fit all stretches by what lies beside them. Halves of the time
share less. As in stability selection they are complementary (Shah and Samworth 2013), in three ways.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.stats import chi2, norm

from irtwin.gap.isolation.ambiguity_groups import as_one
from irtwin.gap.isolation.cause import between_groups, gains, judged, rows
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.cross_validation import attempt
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import Selection

_QUARTERS = 4  # of each run's time
_PAIRS = (((0, 1), (2, 3)), ((0, 2), (1, 3)), ((0, 3), (1, 2)))  # of halves, by their quarters


@dataclass(frozen=True)
class Repeats:
    """How a cause fares in halves of the time.

    sizes: (P, 2) in pairs of halves, as shares of its size in all data; `coefficients` it has, and how many hypotheses
    were `tried`; `shown`: whether the first and the last half by themselves show it as a cause has to be shown.
    """

    sizes: np.ndarray
    coefficients: int
    tried: int
    shown: tuple[bool, bool] = (True, True)

    @property
    def part(self) -> float:
        """0 to 1: of what the cause closes in a half with its size there, what it closes with the other half's.

        The least over the halves.
        """
        apart = np.abs(self.sizes[:, 0] - self.sizes[:, 1])
        least = np.maximum(np.abs(self.sizes).min(axis=1), np.finfo(float).tiny)
        return float(np.clip(1 - (apart / least) ** 2, 0.0, 1.0).min())

    @property
    def p(self) -> float:
        """The p-value: how often halves differ no more where chance made the cause, and it was the best of those tried.

        As in the t-test between groups of time (Ibragimov and Mueller 2010), each pair gives a difference that is
        independent of the others and of the mean, however residuals are correlated within a half. The best of many by
        chance has a mean of some standard errors.
        """
        best = norm.isf(0.25 / self.tried) ** 2 + self.coefficients - 1
        half = (self.sizes[:, 0] - self.sizes[:, 1]) / 2
        return float(chi2.cdf(best * np.sum(half**2) / max(self.sizes.mean(), 1e-9) ** 2, len(half)))


def repeating(finding: Finding, limits: Selection) -> tuple[Repeats | None, ...]:
    """Return how each cause repeats; None where no two halves of the time show it.

    The cause as it is found in all data is given a size in each half, beside the twin and the other causes fitted there
    by themselves. Halves in one of which the motion excites next to nothing of the cause say nothing.
    """
    system = finding.system
    inside = np.array([*range(system.base), *finding.chosen], dtype=int)
    quarters = _quarters(system, inside, finding.attribution.noise)
    shown = [_shown(finding, half, limits) for half in _PAIRS[0]]
    found = []
    for place, cause in enumerate(finding.causes):
        own = np.flatnonzero(np.isin(inside, cause.columns))
        rest = np.setdiff1d(np.arange(len(inside)), own)
        prior = system.prior(inside[rest][system.base :])
        numbers = _left(quarters.sum(axis=0), rest, own, prior).numbers
        sizes = []
        for pair in _PAIRS:
            halves = [_left(quarters[list(half)].sum(axis=0), rest, own, prior) for half in pair]
            said = [half.said(numbers) for half in halves]
            if min(said) > limits.speaks * max(said):
                sizes.append([half.right @ numbers / each for half, each in zip(halves, said, strict=True)])
        tried = len(finding.attribution.hypotheses)
        seen = (shown[0][place], shown[1][place])
        found.append(Repeats(np.array(sizes), len(own), tried, seen) if sizes else None)
    return tuple(found)


@dataclass(frozen=True)
class _Left:
    """Products of what a fit of the rest leaves of a cause's columns: among them (k, k), with the measurement (k,)."""

    among: np.ndarray
    right: np.ndarray

    @property
    def numbers(self) -> np.ndarray:
        """(k,) the coefficients that fit best, in units of their prior."""
        return np.asarray(np.linalg.solve(self.among + np.eye(len(self.right)), self.right))

    def said(self, numbers: np.ndarray) -> float:
        """Return the squares that (k,) coefficients add, beyond what the rest imitates."""
        return float(numbers @ self.among @ numbers)


def _shown(finding: Finding, half: tuple[int, int], limits: Selection) -> list[bool]:
    """Return of each cause whether a half by itself shows it beside the others: enough gain, by enough t."""
    system, causes = _part(finding.system, half), finding.causes
    noise = system.residual_rms(finding.chosen, finding.attribution.noise)
    moments = system.moments(noise)
    found = []
    for cause in causes:
        others = [k for one in causes if one is not cause for k in one.columns]
        trial = attempt(system, moments, others, [[as_one(cause.variants)]])
        mine = judged(system, cause.scope)
        gain, said = gains(system, trial)[0, mine], (trial.said[0] / rows(system))[mine]
        t = between_groups(gain, said, limits) if len(gain) else 0.0
        enough = len(gain) > 0 and np.average(gain, weights=rows(system)[mine]) >= limits.least_gain
        found.append(bool(enough and t >= limits.least_t))
    return found


def _part(system: System, half: tuple[int, int]) -> System:
    """Return the equations of some quarters of the runs' time."""
    kept = np.flatnonzero(np.isin(_quarter(system), half))
    _, group = np.unique(system.group[kept], return_inverse=True)
    blocks = tuple(system.blocks[k] for k in kept)
    return replace(system, blocks=blocks, group=group, observed=system.observed[kept], transient=None)


def _left(products: np.ndarray, rest: np.ndarray, own: np.ndarray, prior: np.ndarray) -> _Left:
    """Return what a fit of the `rest` leaves; products: of all columns, the measurement last."""
    kept = [*own, len(products) - 1]
    weights = solved(factored(products[np.ix_(rest, rest)], prior), products[np.ix_(rest, kept)])
    left = products[np.ix_(kept, kept)] - products[np.ix_(kept, rest)] @ weights
    return _Left(left[:-1, :-1], left[:-1, -1])


def _quarters(system: System, inside: np.ndarray, noise: np.ndarray) -> np.ndarray:
    """Return the products of c columns and the measurement in each quarter of the runs' time, (4, c + 1, c + 1)."""
    place = np.full(len(system.scale), -1)
    place[inside] = np.arange(len(inside))
    level = np.maximum(noise, system.quietest)
    found = np.zeros((_QUARTERS, len(inside) + 1, len(inside) + 1))
    for block, quarter in enumerate(_quarter(system)):
        for equation in range(len(system.pattern)):
            factor, used = system.factor(block, equation)
            here = np.flatnonzero(place[used] >= 0)
            there = np.append(place[used[here]], len(inside))
            rows = factor[:, [*here, -1]] / level[equation]
            found[quarter][np.ix_(there, there)] += rows.T @ rows
    return found


def _quarter(system: System) -> list[int]:
    """Return of each block which quarter of its run's time it is in."""
    runs = [block.run for block in system.blocks]
    seen = dict.fromkeys(runs, 0)
    found = []
    for run in runs:
        found.append(seen[run] * _QUARTERS // runs.count(run))
        seen[run] += 1
    return found
