"""The remainder: what a fit leaves of the power of motions that it did not see, and how far that lasts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy

from irtwin.effects.effect import NORMAL, Term
from irtwin.identification.accumulate import Block
from irtwin.identification.estimators import estimate
from irtwin.identification.uncertainty import LEVEL

T = TypeVar("T")

_FEWEST, _MOST = 4, 12  # groups: fewer tell no scatter, more take time


@dataclass(frozen=True)
class Remainder:
    """What effects leave of power, W, one standard deviation: of a sample, of the mean over `seconds`, of a pause.

    At each pose dry friction holds a share of the load of its own, so a pause is off by as much whenever it stands
    there. Mean and pause are grown so that `NORMAL` of them are half a 95 % interval.
    """

    sample: float
    mean: float
    seconds: float
    pause: float = 0.0

    def energy(self, seconds: float) -> float:
        """Return what is left of the energy of a motion, J: it lasts a whole motion, and is noise in a shorter one."""
        return self.mean * seconds * float(np.sqrt(max(1.0, self.seconds / max(seconds, 1e-9))))


def remainder(
    blocks: Sequence[Block], predicted: Sequence[Block], terms: Sequence[Term], known: np.ndarray | None, ones: int
) -> Remainder | None:
    """Return the remainder of a fit of power, of one equation; None where there are too few blocks to tell.

    Each run, or stretch of time where runs are few, is left out in turn. Its mean residual is that of the others' fit,
    by the same stretches as `predicted`; what is more than their coefficients are unsure by is the remainder. `terms`,
    `known`: of the fit, as `estimate` takes them; `ones`: the place of the column of ones, whose product with the
    residual is the residual's sum.
    """
    by_stretch, groups = {(block.run, block.start): block for block in predicted}, _groups(blocks)
    if len(groups) < _FEWEST:
        return None
    pattern = np.ones((1, len(terms)), dtype=bool)
    more, squares, seconds = [], 0.0, 0.0
    for group in groups:
        others = estimate([block for block in blocks if block not in group], pattern, terms, known)
        factor = np.concatenate([by_stretch[block.run, block.start].factors[0] for block in group])
        rows = sum(int(block.rows[0]) for block in group)
        left = factor @ np.append(-others.values, 1.0)
        row = factor[:, ones] @ factor[:, :-1] / rows
        more.append((factor[:, ones] @ left / rows) ** 2 - row @ others.covariance @ row)
        squares += float(left @ left) / rows
        seconds += sum(block.stop - block.start for block in group)
    count = len(groups)
    return Remainder((squares / count) ** 0.5, _grown(more, np.ones(count)), seconds / count)


def of_pauses(left: Sequence[np.ndarray]) -> float:
    """Return what is left of the mean power of a pause, W, by what is left of each one's samples, W.

    What counts is the energy of a pause, so long ones do. Zero where there are too few to tell.
    """
    if len(left) < _FEWEST:
        return 0.0
    rows = np.array([len(samples) for samples in left])
    return _grown([samples.mean() ** 2 - samples.var() / len(samples) for samples in left], rows**2)


def of_rest(left: Sequence[np.ndarray]) -> float:
    """Return how unsure pauses leave the power at rest, W, one standard deviation; arguments as above.

    That is what is left of their mean: each pose stands for itself, and is off by what dry friction holds there.
    """
    rows = np.array([len(samples) for samples in left], dtype=float)
    return of_pauses(left) * math.sqrt((rows**2).sum()) / max(float(rows.sum()), 1.0)


def _grown(squares: Sequence[float], weights: np.ndarray) -> float:
    """Return the root of a mean of squares, grown so that `NORMAL` of it are half a 95 % interval."""
    grown = float(scipy.special.stdtrit(len(squares) - 1, (1 + LEVEL) / 2)) / NORMAL
    return grown * math.sqrt(max(float(np.average(squares, weights=weights)), 0.0))


def _groups(blocks: Sequence[Block]) -> list[list[Block]]:
    """Return the blocks of each run, or of some; of each stretch of time where there are few runs."""
    runs = list(dict.fromkeys(block.run for block in blocks))
    parts = [[block for block in blocks if block.run == run] for run in runs]
    if len(parts) < _FEWEST:
        pieces = -(-_FEWEST // max(len(parts), 1))
        parts = [list(own) for part in parts for own in _cut(part, pieces)]
    return [[block for part in some for block in part] for some in _cut(parts, _MOST)]


def _cut(parts: Sequence[T], most: int) -> list[list[T]]:
    """Return parts in order, in as many lists as there are parts, and not more than so many."""
    return [[parts[k] for k in own] for own in np.array_split(np.arange(len(parts)), min(most, len(parts)))]
