"""Whether a hypothesis beats chance: signs flipped by stretches of time, the whole catalogue at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.regression.cross_validation import Projected
from irtwin.gap.regression.hypotheses import Hypothesis
from irtwin.identification.accumulate import Block

_FLIPS = 999
FINE = 3999
"""Draws by which another seed moves a p of 0.1 by 0.005, one standard deviation."""


def p_values(
    scores: np.ndarray,
    products: Projected,
    hypotheses: Sequence[Hypothesis],
    seed: int,
    likeness: np.ndarray | None = None,
    flips: int = _FLIPS,
) -> np.ndarray:
    """Return each hypothesis' p-value, adjusted for the whole catalogue (H,).

    scores: (B, D) each block's score of each column; `products` of the projected columns. Where an effect
    is absent a block's score is as likely positive as negative; the largest score statistic over all hypotheses and
    shapes, each in units of its own spread under random signs, says what chance reaches (Westfall and Young's max-T).
    With a `likeness` (B, B), the correlation of blocks near each other, signs become normal numbers that are as alike
    (the dependent wild bootstrap, Shao 2010).
    """
    generator = np.random.default_rng(seed)
    if likeness is None:
        signs = generator.choice([-1.0, 1.0], (flips + 1, len(scores)))
    else:
        signs = generator.standard_normal((flips + 1, len(scores))) @ np.linalg.cholesky(likeness).T
    signs[0] = 1.0
    sums = signs @ scores
    among = products.each([variant.columns for hypothesis in hypotheses for variant in hypothesis.variants])
    statistics = np.stack([_statistic(sums, among, hypothesis) for hypothesis in hypotheses], axis=1)
    normal = np.cbrt(statistics)  # chi-square of any order is then nearly normal (Wilson and Hilferty)
    alike = (normal - normal[1:].mean(axis=0)) / np.maximum(normal[1:].std(axis=0), 1e-12)
    largest = alike.max(axis=1)
    return np.asarray((largest[:, None] >= alike[0] - 1e-12).mean(axis=0))


def likeness(blocks: Sequence[Block], memory: float) -> np.ndarray:
    """Return (B, B) how alike the residuals of blocks are, where these remember `memory` s; those of two runs are not.

    `memory` is the whole of the autocorrelation, on both sides: twice the time constant, so the kernel is wider than
    what it covers, as a narrow one finds too little.
    """
    middle = np.array([(block.start + block.stop) / 2 for block in blocks])
    same = np.array([[one.run == other.run for other in blocks] for one in blocks])
    apart = np.abs(middle[:, None] - middle) / max(memory, 1e-9)
    return np.asarray(np.where(same, np.exp(-apart), 0.0) + 1e-9 * np.eye(len(blocks)))


def _statistic(sums: np.ndarray, among: dict[tuple[int, ...], np.ndarray], hypothesis: Hypothesis) -> np.ndarray:
    best = np.zeros(len(sums))
    for variant in hypothesis.variants:
        normal = among[variant.columns] + np.eye(len(variant.columns))
        own = sums[:, variant.columns]
        best = np.maximum(best, np.einsum("fi,fi->f", own, np.linalg.solve(normal, own.T).T) / len(normal))
    return best
