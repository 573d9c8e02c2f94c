"""Where the gap lies: joint by regime, and the variable that the residual follows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irtwin.signals.motion import Motion

REGIMES = ("standstill", "low_speed", "steady_speed", "accelerating", "braking", "reversal")
_STANDSTILL = 1e-3  # rad/s
_SLOW = 0.1  # of the joint's largest speed
_STEADY = 0.2  # of the joint's largest acceleration
_REVERSAL = 0.1  # s, around a change of direction
_BINS = 12
_LOCATIONS = 12
_LEAST_SHARE = 0.02
_STANDS_OUT = 1.5  # times the floor's square
_UNITS = {
    "angle": "rad",
    "speed": "rad/s",
    "acceleration": "rad/s^2",
    "time": "s",
    "torque": "N m",
    "temperature": "degC",
}

Residuals = Sequence[tuple[Motion, np.ndarray]]


@dataclass(frozen=True)
class Location:
    """A place of the gap with its share of the whole gap in the channel."""

    channel: str
    joint: str | None
    regime: str | None
    follows: str | None
    runs: tuple[str, ...]
    share: float

    def to_json(self) -> dict[str, Any]:
        """Return the location in the form of the schema."""
        return {
            "channel": self.channel,
            "joint": self.joint,
            "regime": self.regime,
            "follows": self.follows,
            "runs": list(self.runs),
            "share": self.share,
        }


def locate(joints: Sequence[str], residuals: Residuals, floor: np.ndarray) -> list[Location]:
    """Rank joints and regimes by their excess over the floor.

    residuals: each run's motion and torque residual (N, n), NaN where undecided; floor: (n,).
    """
    excess = _excess(joints, residuals, floor)
    total = max(float(excess.sum()), 1e-12)
    found = []
    for j, joint in enumerate(joints):
        variable = follows(residuals, j)
        runs = _runs(residuals, j, floor[j])
        for r, regime in enumerate(REGIMES):
            share = float(excess[j, r]) / total
            if share >= _LEAST_SHARE:
                found.append(Location("torque", joint, regime, variable, runs, min(share, 1.0)))
    return sorted(found, key=lambda location: -location.share)[:_LOCATIONS]


def locate_power(
    squares: np.ndarray, rows: np.ndarray, floor: np.ndarray | None, runs: Sequence[tuple[str, ...]]
) -> list[Location]:
    """Return where power is off: the groups of runs that stand out. squares, rows: (G, 1); floor: (1,) W."""
    if floor is None:
        return []
    means = squares[:, 0] / np.maximum(rows[:, 0], 1) / floor[0] ** 2
    worst = [k for k in np.argsort(-means) if means[k] > _STANDS_OUT]
    if not worst:
        return []
    names = dict.fromkeys(run for k in worst for run in runs[k])
    return [Location("power", None, None, None, tuple(names), 1.0)]


def curves(
    effect: str, shown: Sequence[str], joints: Sequence[str], residuals: Residuals, added: Sequence[np.ndarray]
) -> list[dict[str, Any]]:
    """Return, for each joint shown, the residual without an effect against the variable that it follows.

    residuals: each run's motion and residual of a fit that has the effect, less what the effect adds (that is, partial
    residuals); added: (N, n) of each run. Bins hold equal numbers of samples; low and high are their quartiles.
    """
    found = []
    for joint in shown:
        j = joints.index(joint)
        name = follows([(m, a) for (m, _), a in zip(residuals, added, strict=True)], j)
        if name is None:
            continue
        values = _variables(residuals, j)[name]
        residual = np.concatenate([r[:, j] for _, r in residuals])
        fitted = np.concatenate([a[:, j] for a in added])
        kept = np.isfinite(residual)
        place = _places(values[kept])
        bins = [place == k for k in range(2 * _BINS)]
        bins = [inside for inside in bins if inside.any()]
        found.append(
            {
                "effect": effect,
                "joint": joint,
                "variable": name,
                "unit": _UNITS[name],
                "x": [float(np.median(values[kept][inside])) for inside in bins],
                "residual": [float(np.mean(residual[kept][inside])) for inside in bins],
                "low": [float(np.quantile(residual[kept][inside], 0.25)) for inside in bins],
                "high": [float(np.quantile(residual[kept][inside], 0.75)) for inside in bins],
                "fitted": [float(np.mean(fitted[kept][inside])) for inside in bins],
            }
        )
    return found


def _places(values: np.ndarray) -> np.ndarray:
    edges = np.quantile(values, np.linspace(0, 1, 2 * _BINS + 1)[1:-1])
    return np.asarray(np.searchsorted(edges, values))


def heat_map(joints: Sequence[str], residuals: Residuals, floor: np.ndarray) -> dict[str, Any]:
    """Return the mean excess over the floor of each joint and regime, as a page draws it."""
    squares, counts = _sums(joints, residuals)
    with np.errstate(invalid="ignore", divide="ignore"):
        excess = np.where(counts > 0, squares / counts / floor[:, None] ** 2 - 1, 0.0)
    return {"joints": list(joints), "regimes": list(REGIMES), "excess": excess.tolist()}


def follows(residuals: Residuals, joint: int) -> str | None:
    """Return the variable whose bins explain the most of a joint's residual."""
    residual = np.concatenate([r[:, joint] for _, r in residuals])
    kept = np.isfinite(residual)
    if kept.sum() < 10 * _BINS:
        return None
    best, most = None, 0.0
    for name, values in _variables(residuals, joint).items():
        share = _binned(values[kept], residual[kept])
        if share > most:
            best, most = name, share
    return best


def _variables(residuals: Residuals, joint: int) -> dict[str, np.ndarray]:
    motions = [motion for motion, _ in residuals]

    def joined(parts: Sequence[np.ndarray]) -> np.ndarray:
        return np.concatenate(list(parts))

    found = {
        "angle": joined([m.q[:, joint] for m in motions]),
        "speed": joined([m.dq[:, joint] for m in motions]),
        "acceleration": joined([m.ddq[:, joint] for m in motions]),
        "time": joined([m.time - m.time[0] for m in motions]),
    }
    if all(m.torque is not None for m in motions):
        found["torque"] = joined([m.torque[:, joint] - r[:, joint] for m, r in residuals if m.torque is not None])
    if all(m.temperature is not None for m in motions):
        found["temperature"] = joined([m.temperature[:, joint] for m in motions if m.temperature is not None])
    return found


def _binned(values: np.ndarray, residual: np.ndarray) -> float:
    edges = np.quantile(values[np.isfinite(values)], np.linspace(0, 1, _BINS + 1)[1:-1]) if len(values) else []
    place = np.searchsorted(edges, values)
    counts = np.bincount(place, minlength=_BINS)
    means = np.bincount(place, residual, minlength=_BINS) / np.maximum(counts, 1)
    return float(np.sum(counts * means**2) / max(float(np.sum(residual**2)), 1e-30))


def _regimes(motion: Motion, joint: int, fastest: float, sharpest: float) -> np.ndarray:
    speed, acceleration = motion.dq[:, joint], motion.ddq[:, joint]
    regime = np.where(speed * acceleration > 0, 3, 4)
    regime[np.abs(acceleration) < _STEADY * sharpest] = 2
    regime[np.abs(speed) < _SLOW * fastest] = 1
    turns = np.flatnonzero(np.diff(np.sign(speed)) != 0)
    reach = max(1, round(_REVERSAL * motion.rate))
    for turn in turns:
        if np.abs(speed[max(0, turn - reach) : turn + reach]).max(initial=0.0) > _STANDSTILL:
            regime[max(0, turn - reach) : turn + reach] = 5
    regime[np.abs(speed) < _STANDSTILL] = 0
    return regime


def _sums(joints: Sequence[str], residuals: Residuals) -> tuple[np.ndarray, np.ndarray]:
    squares, counts = np.zeros((len(joints), len(REGIMES))), np.zeros((len(joints), len(REGIMES)))
    for j in range(len(joints)):
        fastest = max((float(np.abs(m.dq[:, j]).max()) for m, _ in residuals), default=0.0)
        sharpest = max((float(np.abs(m.ddq[:, j]).max()) for m, _ in residuals), default=0.0)
        for motion, residual in residuals:
            kept = np.isfinite(residual[:, j])
            regime = _regimes(motion, j, fastest, sharpest)[kept]
            squares[j] += np.bincount(regime, residual[kept, j] ** 2, minlength=len(REGIMES))
            counts[j] += np.bincount(regime, minlength=len(REGIMES))
    return squares, counts


def _excess(joints: Sequence[str], residuals: Residuals, floor: np.ndarray) -> np.ndarray:
    squares, counts = _sums(joints, residuals)
    return np.asarray(np.maximum(squares / floor[:, None] ** 2 - counts, 0.0))


def _runs(residuals: Residuals, joint: int, floor: float) -> tuple[str, ...]:
    """Return the runs that stand out over the floor, the worst first."""
    means = {motion.run: float(np.nanmean(residual[:, joint] ** 2)) for motion, residual in residuals}
    above = [run for run, mean in means.items() if mean > _STANDS_OUT * floor**2]
    return tuple(sorted(above, key=lambda run: -means[run]))
