"""The operating variable that a residual follows, and its curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.document.curves import Followed
from irtwin.gap.regression.residuals import Trace
from irtwin.signals.channels import CHANNELS

_BINS = 12
_UNITS = {
    "angle": CHANNELS["q"].unit,
    "speed": CHANNELS["dq"].unit,
    "acceleration": CHANNELS["ddq"].unit,
    "torque": CHANNELS["torque"].unit,
    "temperature": CHANNELS["temperature"].unit,
    "time": CHANNELS["time"].unit,
    "mechanical_power": CHANNELS["power"].unit,
    "torque_squared": "N^2 m^2",
}


def followed(traces: Sequence[Trace], place: int, joint: str | None) -> tuple[str, float] | None:
    """Return the variable that explains the most of a residual, with the share of its mean square.

    place: of the residual, at a joint; None for the whole robot. A joint's is binned apart for either direction of
    motion, as friction changes its sign there.
    """
    residual = _joined([trace.residual[:, place] for trace in traces])
    kept = np.isfinite(residual)
    if kept.sum() < 20 * _BINS:
        return None
    forward = np.zeros(len(residual), dtype=bool)
    if joint is not None:
        forward = _joined([trace.motion.dq[:, place] for trace in traces]) > 0
    shares = {
        name: _explained(values[kept], residual[kept], forward[kept])
        for name, values in variables(traces, None if joint is None else place).items()
    }
    best = max(shares, key=lambda name: shares[name])
    return best, shares[best]


def variables(traces: Sequence[Trace], joint: int | None) -> dict[str, np.ndarray]:
    """Return the operating variables of all samples by name, of a joint or (None) of the whole robot."""
    robot, by_name = joint is None, {}
    motions = [trace.motion for trace in traces]
    if robot:
        by_name["mechanical_power"] = _joined([(t.torque * t.motion.dq).sum(axis=1) for t in traces])
        by_name["torque_squared"] = _joined([(t.torque**2).sum(axis=1) for t in traces])
        by_name["speed"] = _joined([np.abs(motion.dq).sum(axis=1) for motion in motions])
    else:
        by_name["angle"] = _joined([motion.q[:, joint] for motion in motions])
        by_name["speed"] = _joined([motion.dq[:, joint] for motion in motions])
        by_name["acceleration"] = _joined([motion.ddq[:, joint] for motion in motions])
        by_name["torque"] = _joined([trace.torque[:, joint] for trace in traces])
    warm = [motion.temperature for motion in motions if motion.temperature is not None]
    if len(warm) == len(motions):
        by_name["temperature"] = _joined([w.mean(axis=1) if robot else w[:, joint] for w in warm])
    by_name["time"] = _joined([motion.time - motion.time[0] for motion in motions])
    return by_name


def curve(
    channel: str,
    traces: Sequence[Trace],
    place: int,
    joint: str | None,
    name: str,
    effect: str | None = None,
    added: Sequence[np.ndarray] | None = None,
) -> Followed:
    """Return a place's residual against a variable, in bins of equal numbers of samples; low and high are quartiles.

    added: (N, g) of each trace, what an effect adds: the curve fitted to the residual.
    """
    values = variables(traces, None if joint is None else place)[name]
    residual = _joined([trace.residual[:, place] for trace in traces])
    kept = np.isfinite(residual)
    bin_of = _places(values[kept], 2 * _BINS)
    bins = [inside for k in range(2 * _BINS) if (inside := bin_of == k).any()]
    fitted = None if added is None else _joined([part[:, place] for part in added])[kept]
    return Followed(
        channel=channel,
        joint=joint,
        effect=effect,
        variable=name,
        unit=_UNITS[name],
        x=tuple(float(np.median(values[kept][inside])) for inside in bins),
        residual=tuple(float(np.mean(residual[kept][inside])) for inside in bins),
        low=tuple(float(np.quantile(residual[kept][inside], 0.25)) for inside in bins),
        high=tuple(float(np.quantile(residual[kept][inside], 0.75)) for inside in bins),
        fitted=None if fitted is None else tuple(float(np.mean(fitted[inside])) for inside in bins),
    )


def _joined(parts: Sequence[np.ndarray]) -> np.ndarray:
    return np.concatenate(list(parts))


def _places(values: np.ndarray, bins: int) -> np.ndarray:
    return np.asarray(np.searchsorted(np.quantile(values, np.linspace(0, 1, bins + 1)[1:-1]), values))


def _explained(values: np.ndarray, residual: np.ndarray, forward: np.ndarray) -> float:
    """Return the share of the residual's mean square that the means of its bins make."""
    place = _places(values, _BINS) + _BINS * forward
    counts = np.bincount(place, minlength=2 * _BINS)
    means = np.bincount(place, residual, minlength=2 * _BINS) / np.maximum(counts, 1)
    return float(np.sum(counts * means**2) / max(float(np.sum(residual**2)), np.finfo(float).tiny))
