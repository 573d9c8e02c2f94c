"""A series that should be noise: what two runs of one motion differ by, beside what follows the motion in it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import scipy

from irtwin.effects.friction import SLOW
from irtwin.signals.motion import Motion

_WILD = 6.0  # spreads: what lies beyond is a joint that turned back at another instant, and is cut there
SPREAD = 1.4826  # standard deviation of what is normal, over its median deviation
_WINDOW = 5.0  # times the correlation time: further lags add noise alone (Sokal 1997)


@dataclass(frozen=True)
class EvenSeries:
    """Even samples: `time` (N,) s, `values` (N,), and `beside` (N, m), columns that may explain any part of them."""

    time: np.ndarray
    values: np.ndarray
    beside: np.ndarray

    @property
    def seconds(self) -> float:
        """How long it lasts."""
        return float(self.time[-1] - self.time[0])

    @property
    def rate(self) -> float:
        """Samples per second, Hz."""
        return (len(self.time) - 1) / self.seconds

    def with_columns(self, *columns: np.ndarray) -> EvenSeries:
        """Return the series with more columns beside it, (N,) each."""
        return replace(self, beside=np.column_stack([self.beside, *columns]))

    def basis(self) -> np.ndarray:
        """Return orthonormal columns (N, r) that span those beside it."""
        scaled = self.beside / np.maximum(np.linalg.norm(self.beside, axis=0), 1e-300)
        left, size, _ = np.linalg.svd(scaled, full_matrices=False)
        return np.asarray(left[:, size > 1e-8 * size.max(initial=0.0)])

    def coefficients(self) -> np.ndarray:
        """Return the coefficients (m,) of the columns beside it in a fit to the values."""
        scale = np.maximum(np.linalg.norm(self.beside, axis=0), 1e-300)
        coefficients: np.ndarray = np.linalg.lstsq(self.beside / scale, self.values, rcond=1e-8)[0] / scale
        return coefficients

    def left(self) -> np.ndarray:
        """Return what the columns beside it leave of the values, (N,)."""
        basis = self.basis()
        return np.asarray(self.values - basis @ (basis.T @ self.values))

    def tamed(self) -> EvenSeries:
        """Return the series with wild samples cut: what is far beyond the spread of what is left."""
        left = self.left()
        most = _WILD * SPREAD * float(np.median(np.abs(left)))
        return replace(self, values=self.values - left + np.clip(left, -most, most)) if most > 0 else self


def waves(time: np.ndarray, frequency: float) -> tuple[np.ndarray, np.ndarray]:
    """Return cosine and sine of a frequency, Hz, at some times, (N,) each."""
    angle = 2 * np.pi * frequency * time
    return np.cos(angle), np.sin(angle)


def following(motion: Motion, joint: int) -> np.ndarray:
    """Return what may follow a joint's motion in its torque, (N, 5), a constant and a drift first: friction, inertia.

    The torque itself is not among the columns: it holds the disturbance.
    """
    dq, since = motion.dq[:, joint], motion.time - motion.time.mean()
    return np.column_stack([np.ones_like(dq), since, dq, np.tanh(dq / SLOW), motion.ddq[:, joint]])


def correlation_samples(residual: np.ndarray) -> float:
    """Return of how many samples (N,), at least one, one says as much as an independent one.

    The sum of the autocorrelation over all lags, cut where it has become noise.
    """
    left, count = residual - residual.mean(), len(residual)
    products = scipy.signal.correlate(left, left, method="fft")[count - 1 :][: count // 2]
    if count < 4 or products[0] <= 0:
        return 1.0
    times = 2 * np.cumsum(products / products[0] * count / (count - np.arange(len(products)))) - 1
    enough = np.flatnonzero(np.arange(len(times)) >= _WINDOW * times)
    return float(max(1.0, times[enough[0] if len(enough) else -1]))
