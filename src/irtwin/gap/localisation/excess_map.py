"""The map of the gap: squared residuals summed by joint and regime, run by run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.document.curves import ExcessMap
from irtwin.gap.localisation.regimes import (
    JOINT_PARTS,
    JOINT_REGIMES,
    ROBOT_PARTS,
    ROBOT_REGIMES,
    joint_regimes,
    robot_regimes,
)
from irtwin.gap.regression.residuals import Trace
from irtwin.gap.thresholds import Thresholds

_STRETCHES = 8


@dataclass(frozen=True)
class Regimes:
    """R names of regimes; the first `parts` of them part the samples, the others overlap with these."""

    names: tuple[str, ...]
    parts: int


@dataclass(frozen=True)
class Map:
    """Sums over the samples of U units (runs, or stretches of them), g places (joints, or the robot), R regimes.

    squares: (U, g, R) of residuals, N^2 m^2 or W^2; counts: (U, g, R) of samples.
    """

    regimes: Regimes
    squares: np.ndarray
    counts: np.ndarray

    @property
    def means(self) -> np.ndarray:
        """(g, R) mean squares over all units; NaN where there is no sample."""
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(self.squares.sum(axis=0) / self.counts.sum(axis=0))


def joint_maps(kinds: Sequence[Sequence[Trace]], labels: Mapping[str, str], limits: Thresholds) -> list[Map | None]:
    """Sum the squares of torque residuals of several kinds of traces, None of a kind that has none.

    labels: each run's programmed motion, whose runs make one unit. Regimes are told alike in all kinds.
    """
    traces = [trace for kind in kinds for trace in kind]
    motions, torques = [trace.motion for trace in traces], [trace.torque for trace in traces]
    masks = [joint_regimes(motions, torques, joint, limits.regimes) for joint in range(traces[0].residual.shape[1])]
    return _maps(kinds, masks, Regimes(JOINT_REGIMES, JOINT_PARTS), labels, limits.places.fewest_units)


def robot_maps(kinds: Sequence[Sequence[Trace]], labels: Mapping[str, str], limits: Thresholds) -> list[Map | None]:
    """Sum the squares of power residuals, as `joint_maps` those of torque."""
    traces = [trace for kind in kinds for trace in kind]
    masks = [robot_regimes([trace.motion for trace in traces], [trace.torque for trace in traces], limits.regimes)]
    return _maps(kinds, masks, Regimes(ROBOT_REGIMES, ROBOT_PARTS), labels, limits.places.fewest_units)


def level_of(floor: np.ndarray | None, seen: Map, reference: Map | None, fewest: int) -> np.ndarray:
    """Return the mean square beyond which a gap lies, (g, R): the floor's, or what the reference runs show if more.

    floor: (g,) RMS; where none is known, the mean square in the regime that has the least stands in for its square.
    """
    whole = _least(seen, fewest) if floor is None else floor**2
    level = np.repeat(np.maximum(whole, np.finfo(float).tiny)[:, None], len(seen.regimes.names), axis=1)
    if reference is None:
        return level
    enough = reference.counts.sum(axis=0) >= fewest
    return np.where(enough, np.fmax(level, reference.means), level)


def heat_map(joints: Sequence[str], seen: Map, level: np.ndarray) -> ExcessMap:
    """Return the mean excess of each joint and regime, as a page draws it."""
    excess = np.nan_to_num(seen.means / level - 1)
    return ExcessMap(joints=tuple(joints), regimes=tuple(seen.regimes.names), excess=tuple(map(tuple, excess.tolist())))


def _least(seen: Map, fewest: int) -> np.ndarray:
    parts = slice(seen.regimes.parts)
    enough = seen.counts.sum(axis=0)[:, parts] >= fewest
    return np.asarray(np.min(np.where(enough, seen.means[:, parts], np.inf), axis=1))


def _maps(
    kinds: Sequence[Sequence[Trace]],
    masks: Sequence[Sequence[np.ndarray]],
    regimes: Regimes,
    labels: Mapping[str, str],
    fewest: int,
) -> list[Map | None]:
    found: list[Map | None] = []
    start = 0
    for kind in kinds:
        own = [mask[start : start + len(kind)] for mask in masks]
        found.append(_sums(kind, own, regimes, labels, fewest) if kind else None)
        start += len(kind)
    return found


def _sums(
    traces: Sequence[Trace],
    masks: Sequence[Sequence[np.ndarray]],
    regimes: Regimes,
    labels: Mapping[str, str],
    fewest: int,
) -> Map:
    units = _units(traces, labels, fewest)
    count = 1 + max(int(unit.max()) for unit in units)
    squares = np.zeros((count, len(masks), len(regimes.names)))
    counts = np.zeros(squares.shape)
    for k, (trace, unit) in enumerate(zip(traces, units, strict=True)):
        for place, mask in enumerate(masks):
            kept = np.isfinite(trace.residual[:, place])
            square = trace.residual[kept, place] ** 2
            for regime, inside in enumerate(mask[k][kept].T):
                squares[:, place, regime] += np.bincount(unit[kept][inside], square[inside], count)
                counts[:, place, regime] += np.bincount(unit[kept][inside], minlength=count)
    return Map(regimes, squares, counts)


def _units(traces: Sequence[Trace], labels: Mapping[str, str], fewest: int) -> list[np.ndarray]:
    """Return the unit of each trace's samples (N,): the run's programmed motion; few of them are cut in time."""
    order = {label: k for k, label in enumerate(dict.fromkeys(labels[trace.motion.run] for trace in traces))}
    pieces = 1 if len(order) >= fewest else -(-_STRETCHES // len(order))
    return [
        order[labels[trace.motion.run]] * pieces + np.arange(len(trace.residual)) * pieces // len(trace.residual)
        for trace in traces
    ]
