"""How much a block of a log counts in a fit: less where the fit leaves much of it.

Somebody leans on the arm, a channel drops out, a load is not on record: to least squares such a second outweighs all
others, as its residual is squared.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import groupby

import numpy as np

from irtwin.document.odd_stretch import OddStretch
from irtwin.identification.accumulate import Block

_FREEDOM = 4.0  # degrees of freedom of Student's t, as Lange, Little and Taylor 1989 take where nothing is known
_MISFIT = 0.01  # of what was measured, RMS: no law of an effect is better, so that a block that leaves less is not odd
SETTLED = 0.02  # weights that change by less stay
_ODD = 0.1  # a block of less weight leaves over 6.8 times as much as others: of nine measured robots seven have none


def robust_weights(
    squares: np.ndarray, rows: np.ndarray, noise: float | np.ndarray, measured: float | np.ndarray
) -> np.ndarray:
    """Return the weights of blocks, (B, ...), of whose `rows` a fit leaves `squares`.

    `noise`, `measured`: RMS of what the fit leaves, and of what was measured.

    They are the weights of maximum likelihood for residuals of Student's t (K. L. Lange, R. J. A. Little and
    J. M. G. Taylor, "Robust statistical modeling using the t distribution", JASA 84, 1989), one a row
    in the mean: a block that leaves ten times as much as the others, RMS, has some 0.05. One where there are no rows.
    """
    size = np.sqrt(squares / np.maximum(rows, 1)) / np.hypot(noise, _MISFIT * measured)
    weights = 1 / (_FREEDOM + size**2)
    total = (weights * rows).sum(axis=0)
    return np.where(total > 0, weights * rows.sum(axis=0) / np.maximum(total, np.finfo(float).tiny), 1.0)


def odd_stretches(blocks: Sequence[Block], weights: np.ndarray, joints: Sequence[str]) -> tuple[OddStretch, ...]:
    """Return the stretches of blocks (B,) that count for little, `weights` (B, n), at one of n joints: least first."""
    spans = []
    marked = zip(blocks, weights, strict=True)
    for (run, odd), group in groupby(marked, key=lambda pair: (pair[0].run, bool((pair[1] < _ODD).any()))):
        if odd:
            own = list(group)
            least = np.min([weight for _, weight in own], axis=0)
            named = tuple(name for name, weight in zip(joints, least, strict=True) if weight < _ODD)
            spans.append((least.min(), OddStretch(run=run, start=own[0][0].start, stop=own[-1][0].stop, joints=named)))
    return tuple(stretch for _, stretch in sorted(spans, key=lambda pair: pair[0]))
