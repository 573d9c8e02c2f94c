"""Joint motions as finite Fourier series that start and end at rest (Yan 2018, eq. 4)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy

GRID_PER_HARMONIC = 32


@dataclass(frozen=True)
class FourierSeries:
    """q_j(t) = centre_j + sum_k sine_kj sin(k w t) + cosine_kj cos(k w t), w = 2 pi / period, k = 1..K.

    period: s; centre: (n,); sine, cosine: (K, n), rad (m for a prismatic joint).
    """

    period: float
    centre: np.ndarray
    sine: np.ndarray
    cosine: np.ndarray

    @property
    def harmonics(self) -> int:
        """The number K of harmonics."""
        return len(self.sine)

    def motion(self, time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return q, dq, ddq, each (N, n) in rad, rad/s, rad/s^2, at `time`: (N,) s."""
        w = 2 * np.pi / self.period * np.arange(1, self.harmonics + 1)
        sin, cos = np.sin(np.outer(time, w)), np.cos(np.outer(time, w))
        q = self.centre + sin @ self.sine + cos @ self.cosine
        dq = (cos * w) @ self.sine - (sin * w) @ self.cosine
        ddq = -(sin * w**2) @ self.sine - (cos * w**2) @ self.cosine
        return q, dq, ddq

    def grid(self) -> np.ndarray:
        """Return evenly spaced instants over one period, dense enough for `between_samples`: (M,) s."""
        count = GRID_PER_HARMONIC * self.harmonics
        return np.arange(count) * (self.period / count)


def between_samples(harmonics: int, count: int) -> float:
    """Return f such that max |p(t)| <= f max |p(t_i)| for `count` even instants t_i of one period.

    p is any real trigonometric polynomial of degree `harmonics` < count / 2. Proof (M. Riesz 1914): where |p| has its
    maximum P, at t*, |p(t)| >= P cos(K w (t - t*)) as long as the angle is below pi / 2; some t_i lies within half a
    step, that is within an angle of K pi / count. Position (about any constant), speed and acceleration of a
    FourierSeries are all of degree K.
    """
    if count <= 2 * harmonics:
        raise ValueError(f"{count} samples cannot bound {harmonics} harmonics")
    return 1.0 / float(np.cos(np.pi * harmonics / count))


class RestSeries:
    """The FourierSeries of n joints that start and end at rest, as linear functions of free numbers x.

    x: (2 K - 1, n): the centre, then K - 1 numbers for the sines and K - 1 for the cosines of each joint.
    dq(0) = w sum_k k sine_k = 0 and ddq(0) = -w^2 sum_k k^2 cosine_k = 0 bind the two kinds apart. The series repeats
    every period, so a motion of whole periods ends as it starts: at rest, in the same pose.
    """

    def __init__(self, period: float, harmonics: int) -> None:
        self.period = period
        self.harmonics = harmonics
        k = np.arange(1.0, harmonics + 1)[None]
        self._sine, self._cosine = scipy.linalg.null_space(k), scipy.linalg.null_space(k**2)  # (K, K - 1), orthonormal
        count = 2 * harmonics - 1
        units = FourierSeries(period, *self._split(np.eye(count)))
        self.grid = units.grid()
        # (M, 2 K - 1) each: a motion is bases @ x, a gradient with respect to x is bases.T @ gradient
        self.bases = units.motion(self.grid)

    def series(self, x: np.ndarray) -> FourierSeries:
        """Return the motion that `x` stands for."""
        return FourierSeries(self.period, *self._split(x))

    def _split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return x[0], self._sine @ x[1 : self.harmonics], self._cosine @ x[self.harmonics :]
