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
    blocks = accumulate_any(motions, with_progress(difference, motions, tell), pattern, by_products=True)
    found = []
    for equation, row in enumerate(pattern):
        size = int(row.sum()) + 1
        rows = sum(int(block.rows[equation]) for block in blocks)
        total = sum((block.factors[equation].T @ block.factors[equation] for block in blocks), np.zeros((size, size)))
        found.append(total / max(rows, 1))
    return tuple(found)
