"""The zero-phase low-pass filter that regressors and measurements share.

A symmetric FIR kernel: zero phase by construction, and of finite length, so that a long run can be filtered in
pieces that join exactly, and decimated while it is filtered.
"""

from __future__ import annotations

import numpy as np
import scipy

_LOBES = 3  # of the sinc on either side: 1e-4 lost at a tenth of the cutoff, nothing left from twice it on
FEWEST_PERIODS = 10  # of the cutoff in a run: the kernel spans six
_OVERSAMPLING = 4  # samples kept per cutoff period after decimation
_AT_ONCE = 16  # samples that are filtered and decimated as one product of matrices


def kernel(rate: float, cutoff: float) -> np.ndarray:
    """Return the symmetric low-pass kernel, (2 K + 1,) of sum one: a sinc under a Blackman window.

    rate, cutoff in Hz. Where the cutoff reaches the Nyquist frequency nothing is to be filtered: the kernel is [1].
    """
    if cutoff >= rate / 2:
        return np.ones(1)
    half = round(_LOBES * rate / (2 * cutoff))
    steps = np.arange(-half, half + 1)
    taps = np.sinc(2 * cutoff / rate * steps) * np.blackman(2 * half + 3)[1:-1]
    return np.asarray(taps / taps.sum())


def low_pass(signal: np.ndarray, rate: float, cutoff: float) -> np.ndarray:
    """Filter along the first axis without phase shift; same shape.

    The ends are continued by reflection in their end points, so constants and ramps pass unchanged.
    """
    taps = kernel(rate, cutoff)
    half = min(len(taps) // 2, len(signal) - 1)
    if half == 0:
        return np.array(signal, dtype=float)
    taps = taps[len(taps) // 2 - half : len(taps) // 2 + half + 1]
    before = 2 * signal[0] - signal[half:0:-1]
    after = 2 * signal[-1] - signal[-2 : -half - 2 : -1]
    padded = np.concatenate([before, signal, after])
    return _convolved(padded, taps / taps.sum())


def smoothed(values: np.ndarray, gap: float, lasts: float) -> list[np.ndarray]:
    """Return values (N, ...), `gap` s apart, smoothed over `lasts` s by cubics, and their two derivatives."""
    rows = min(2 * max(2, round(lasts / gap / 2)) + 1, (len(values) - 1) // 2 * 2 + 1)
    order = min(3, rows - 1)
    return [scipy.signal.savgol_filter(values, rows, order, deriv=deriv, delta=gap, axis=0) for deriv in range(3)]


def lagged(values: np.ndarray, keep: float, before: float = 0.0) -> np.ndarray:
    """Return (N, ...) under a lag of first order: of each value `keep` is of the one before, the first's `before`."""
    bands = np.array([np.ones(len(values)), np.full(len(values), -keep)])
    driven = (1 - keep) * values
    driven[0] += keep * before
    return np.asarray(scipy.linalg.solve_banded((1, 0), bands, driven))


def decimation(rate: float, cutoff: float) -> int:
    """Return the step between samples that still carries everything below the cutoff."""
    return max(1, int(rate / (_OVERSAMPLING * cutoff)))


def decimate(signal: np.ndarray, taps: np.ndarray, step: int) -> np.ndarray:
    """Filter (N, ...) by the (2 K + 1,) taps and keep every step-th sample from sample K to N - K (exclusive)."""
    flat = signal.reshape(len(signal), -1)
    count = max(0, -(-(len(flat) - len(taps) + 1) // step))
    if len(taps) == 1:
        return flat[::step].reshape((count, *signal.shape[1:]))
    kept = banded(_band(taps, step, _AT_ONCE), flat, count, _AT_ONCE * step)
    return kept.reshape((count, *signal.shape[1:]))


def banded(band: np.ndarray, signal: np.ndarray, count: int, advance: int) -> np.ndarray:
    """Return `count` rows: those of band (R, L) by the signal (N, k), which moves on by `advance` after each R."""
    made = np.empty((count, signal.shape[1]))
    rows, length = band.shape
    for number in range(count // rows):
        start = number * advance
        np.matmul(band, signal[start : start + length], out=made[number * rows : (number + 1) * rows])
    if left := count % rows:
        last = signal[count // rows * advance :][:length]
        made[count - left :] = band[:left, : len(last)] @ last
    return made


def _band(taps: np.ndarray, step: int, rows: int) -> np.ndarray:
    """Return the matrix that filters and decimates: each row is the taps, `step` further on than in the last."""
    band = np.zeros((rows, (rows - 1) * step + len(taps)))
    for row in range(rows):
        band[row, row * step : row * step + len(taps)] = taps
    return band


def _convolved(signal: np.ndarray, taps: np.ndarray) -> np.ndarray:
    """Return (N, ...) under (K,) taps where these have all their samples, (N - K + 1, ...)."""
    length = scipy.fft.next_fast_len(len(signal), real=True)
    passed = scipy.fft.rfft(taps, length).reshape(-1, *[1] * (signal.ndim - 1))
    filtered = scipy.fft.irfft(scipy.fft.rfft(signal, length, axis=0) * passed, length, axis=0)
    return np.asarray(filtered[len(taps) - 1 : len(signal)])
