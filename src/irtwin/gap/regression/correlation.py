"""How long a residual remembers: its integrated autocorrelation time."""

from __future__ import annotations

import numpy as np

_WINDOW = 5.0  # times the correlation time: further lags add noise alone (Sokal 1997)


def correlation_samples(residual: np.ndarray) -> float:
    """Return of how many samples (N,), at least one, one says as much as an independent one; NaN are left out.

    The sum of the autocorrelation over all lags, cut where it has become noise.
    """
    known = np.isfinite(residual)
    count = int(known.sum())
    if count < 4:
        return 1.0
    left = np.where(known, residual - residual[known].mean(), 0.0)
    length = 2 ** int(np.ceil(np.log2(2 * len(left))))
    spectrum, both = (np.abs(np.fft.rfft(each, length)) ** 2 for each in (left, known.astype(float)))
    products, pairs = (np.fft.irfft(each, length)[: len(left) // 2] for each in (spectrum, both))
    if products[0] <= 0:
        return 1.0
    correlation = products / np.maximum(pairs, 0.5) * (pairs[0] / products[0])
    times = 2 * np.cumsum(correlation) - 1
    enough = np.flatnonzero(np.arange(len(times)) >= _WINDOW * times)
    return float(max(1.0, times[enough[0] if len(enough) else -1]))
