"""Description length (Rissanen): what a model that says more of a series saves, to hold against what it costs; nats."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.regression.correlation import correlation_samples


def saved(before: Sequence[np.ndarray], after: Sequence[np.ndarray]) -> float:
    """Return what is saved where residuals `before` become those `after`, (N,) each: their likelihood's logarithm.

    Samples of one series count for fewer, as long as what is left after remembers.
    """
    return sum(map(_saved, before, after))


def _saved(before: np.ndarray, after: np.ndarray) -> float:
    least = np.finfo(float).tiny
    ratio = max(float(np.mean(before**2)), least) / max(float(np.mean(after**2)), least)
    return len(after) / (2 * correlation_samples(after)) * float(np.log(ratio))
