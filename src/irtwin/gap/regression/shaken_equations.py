"""What noise of positions puts into the equations: errors in the columns, which what is left of a fit shares.

The columns of noisy positions are noisy. A fit leaves the noise of its columns, each times its coefficient, and a
candidate whose column has the same noise seems to explain that. As much noise is added once more to find its products
(simulation extrapolation: Cook and Stefanski 1994).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.identification.accumulate import Equations, Rows, accumulate_any
from irtwin.identification.progress import Tell, with_progress
from irtwin.signals.motion import Motion

Pairs = Sequence[tuple[Motion, Motion]]  # motions, each with the same once more, shaken


def shaken_products(
    pairs: Pairs, equations: Equations, again: Equations, pattern: np.ndarray, tell: Tell | None = None
) -> tuple[np.ndarray, ...] | None:
    """Return each equation's products a row, (k + 1, k + 1), of what shaking changes; None where there is no pair.

    `pattern`: (g, K) which columns each has; the last is the measurement's, less what is known. `equations` are of the
    motions as they are, `again` the same of shaken ones.
    """
    if not pairs:
        return None
    partner = {id(motion): other for motion, other in pairs}

    def difference(motion: Motion) -> Rows:
        whole = partner[id(motion.whole or motion)]
        one, other = equations(motion), again(whole.part(motion.start, motion.start + len(motion.time)))
        columns = [
            [b - a for a, b in zip(one.own(k, used), other.own(k, used), strict=True)] for k, used in enumerate(pattern)
        ]
        undecided = None
        if one.undecided is not None and other.undecided is not None:
            undecided = one.undecided | other.undecided
        return Rows(columns, other.known - one.known, np.zeros_like(one.measured), undecided)

    motions = [motion for motion, _ in pairs]
    told = with_progress(difference, motions, tell)
    rows, found = np.zeros(len(pattern)), [np.zeros((size, size)) for size in pattern.sum(axis=1) + 1]
    for motion in motions:  # one by one: blocks of all together take many times what their products do
        for block in accumulate_any([motion], told, pattern, by_products=True):
            rows += block.rows
            for total, factor in zip(found, block.factors, strict=True):
                total += factor.T @ factor
    return tuple(total / max(count, 1.0) for total, count in zip(found, rows, strict=True))
