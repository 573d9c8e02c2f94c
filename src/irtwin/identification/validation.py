"""How well a model does on data, and which data are kept out of its fit to judge it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.signals.motion import Motion

FIT, HELD_OUT, APART = "fit", "held_out", "apart"
_FEW = 3  # runs that differ; fewer are cut in time instead
FIT_SHARE = 2 / 3
_GOLDEN = (1 + 5**0.5) / 2


@dataclass(frozen=True)
class Split:
    """The motions that are fitted, those that judge the fit, and the rule in words."""

    fit: tuple[Motion, ...]
    held_out: tuple[Motion, ...]
    rule: str

    def part(self, run: str) -> str:
        """Return the run's part: "fit", "held_out", "both" where it was cut in time, "apart" where it is neither."""
        fitted = any(motion.run == run for motion in self.fit)
        judged = any(motion.run == run for motion in self.held_out)
        return "both" if fitted and judged else FIT if fitted else HELD_OUT if judged else APART


def split(motions: Sequence[Motion], repeats: dict[str, str] | None = None) -> Split:
    """Split motions into a part to fit and a part to judge.

    `repeats`: name of a run -> run whose programmed motion it repeats. Runs of one programmed motion stay
    together. With three or more such groups about one in three is held out: the k-th (from 1) where the fraction
    of k times the golden ratio lies below 1/3, so that no regular order of a log (every third run a work cycle)
    falls on one side. With fewer, each run is cut in time, its first two thirds fitted and the rest held out.
    """
    groups = _groups(motions, repeats or {})
    if len(groups) < _FEW:
        cuts = [round(FIT_SHARE * len(motion.time)) for motion in motions]
        return Split(
            tuple(motion.part(0, cut) for motion, cut in zip(motions, cuts, strict=True)),
            tuple(motion.part(cut, len(motion.time)) for motion, cut in zip(motions, cuts, strict=True)),
            "each run cut in time: first two thirds fitted, last third held out",
        )
    judged = {run for k, group in enumerate(groups, 1) if k * _GOLDEN % 1 < 1 - FIT_SHARE for run in group}
    return Split(
        tuple(motion for motion in motions if motion.run not in judged),
        tuple(motion for motion in motions if motion.run in judged),
        "one programmed motion in three held out, with its repeats",
    )


def _groups(motions: Sequence[Motion], repeats: dict[str, str]) -> list[list[str]]:
    groups: dict[str, list[str]] = {}
    for motion in motions:
        first = motion.run
        while first in repeats and repeats[first] != first:
            first = repeats[first]
        groups.setdefault(first, []).append(motion.run)
    return list(groups.values())


def rmse(measured: np.ndarray, modelled: np.ndarray) -> np.ndarray:
    """Return the root mean square error along the first axis."""
    return np.asarray(np.sqrt(np.mean((measured - modelled) ** 2, axis=0)))


def r_squared(measured: np.ndarray, modelled: np.ndarray) -> np.ndarray:
    """Return 1 - error variance / variance of the measurement along the first axis; NaN where that is zero."""
    variance = np.var(measured, axis=0)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(variance > 0, 1 - np.mean((measured - modelled) ** 2, axis=0) / variance, np.nan))


def energy(time: np.ndarray, power: np.ndarray) -> float:
    """Return the integral of power over time in J (Yan 2018, eqs. 9, 13, 14), by the trapezoidal rule."""
    return float(np.trapezoid(power, time))


def energy_error(measured: float, modelled: float) -> float | None:
    """Return the relative error in percent (Yan 2018, eq. 15); None where none was measured to be relative to."""
    return abs(modelled - measured) / abs(measured) * 100 if measured else None
