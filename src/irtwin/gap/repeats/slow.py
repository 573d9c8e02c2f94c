"""What is slow: an offset between two runs of one motion, or a drift of one against the other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.stats import t as student_t

from irtwin.gap.regression.correlation import correlation_samples
from irtwin.gap.repeats.series import Series

_SLOW = 2  # columns of a series: a constant, and how it drifts, stand first beside it


@dataclass(frozen=True)
class Slow:
    """The `offset` of a difference at mid-time, and its `drift` a second, each with its deviation and p.

    `sizes`: the mean squares of both in one run; `start`, s: what the drift is multiplied by where it begins.
    """

    offset: float
    offset_deviation: float
    drift: float
    drift_deviation: float
    p: tuple[float, float]
    sizes: tuple[float, float]
    start: float

    def from_start(self) -> tuple[float, float]:
        """Return the offset where the difference begins, before anything has drifted, with its deviation."""
        by = float(np.hypot(self.offset_deviation, self.start * self.drift_deviation))
        return self.offset + self.start * self.drift, by


def slow(series: Series) -> Slow:
    """Return the offset and the drift of a difference; what is left remembers, so its samples count for fewer."""
    beside = series.beside
    scale = np.maximum(np.linalg.norm(beside, axis=0), 1e-300)
    inverse = np.linalg.pinv(beside / scale, rcond=1e-8)
    values = inverse @ series.values / scale
    left = series.values - beside @ values
    memory = correlation_samples(left)
    free = max(len(left) / memory - beside.shape[1], 1.0)
    variance = float(left @ left) / len(left) * memory * (1 + beside.shape[1] / free)
    deviations = np.sqrt(np.sum(inverse[:_SLOW] ** 2, axis=1) * variance) / scale[:_SLOW]
    p = 2 * student_t.sf(np.abs(values[:_SLOW]) / np.maximum(deviations, 1e-300), free)
    sizes = values[0] ** 2 / 2, values[1] ** 2 / 2 * float(np.var(beside[:, 1]))
    return Slow(
        float(values[0]), float(deviations[0]), float(values[1]), float(deviations[1]),
        (float(p[0]), float(p[1])), (float(sizes[0]), float(sizes[1])), float(beside[0, 1]),
    )  # fmt: skip
