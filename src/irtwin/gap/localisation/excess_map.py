"""The map of the gap: squared residuals summed by joint and regime, run by run."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.document.curves import ExcessMap
from irtwin.effects.friction import CoulombFriction
from irtwin.gap.regression.groups import FEWEST_GROUPS, Grouping
from irtwin.gap.regression.residuals import Trace
from irtwin.signals.motion import Motion

_STRETCHES = 8  # of time, into which few motions are cut
FEWEST = 20  # samples: the mean square of fewer says nothing
STANDSTILL, LOW_SPEED, STEADY_SPEED = "standstill", "low_speed", "steady_speed"
ACCELERATING, BRAKING, REVERSAL = "accelerating", "braking", "reversal"
LOADED, REGENERATING, AFTER_MOTION = "loaded", "regenerating", "after_motion"

JOINT_REGIMES = (STANDSTILL, REVERSAL, LOW_SPEED, STEADY_SPEED, ACCELERATING, BRAKING, LOADED)
ROBOT_REGIMES = (STANDSTILL, STEADY_SPEED, ACCELERATING, BRAKING, REGENERATING, LOADED, AFTER_MOTION)
JOINT_PARTS, ROBOT_PARTS = 6, 4  # the first of them, which part the samples; the others overlap with these

_LARGE = 0.99  # quantile that counts as a signal's largest value: a filter's ends may ring beyond it


@dataclass(frozen=True)
class Map:
    """Sums over the samples of U units (runs, or stretches of them), g places (joints, or the robot), R regimes.

    regimes: their names; the first `parts` of them part the samples, the others overlap with these.
    squares: (U, g, R) of residuals, N^2 m^2 or W^2; counts: (U, g, R) of samples.
    """

    regimes: tuple[str, ...]
    parts: int
    squares: np.ndarray
    counts: np.ndarray

    @property
    def means(self) -> np.ndarray:
        """(g, R) mean squares over all units; NaN where there are too few samples."""
        counts = self.counts.sum(axis=0)
        means = self.squares.sum(axis=0) / np.maximum(counts, 1)
        return np.asarray(np.where(counts >= FEWEST, means, np.nan))


def joint_maps(kinds: Sequence[Sequence[Trace]], grouping: Grouping, slow: float) -> list[Map | None]:
    """Sum the squares of torque residuals of several kinds of traces, None of a kind that has none.

    The runs of one programmed motion make one unit. Regimes are told alike in all kinds, by the share `slow`.
    """
    motions, torques = _made(kinds)
    masks = [joint_regimes(motions, torques, joint, slow) for joint in range(motions[0].dq.shape[1])]
    return _maps(kinds, masks, (JOINT_REGIMES, JOINT_PARTS), grouping)


def robot_maps(kinds: Sequence[Sequence[Trace]], grouping: Grouping, slow: float) -> list[Map | None]:
    """Sum the squares of power residuals, as `joint_maps` those of torque."""
    return _maps(kinds, [robot_regimes(*_made(kinds), slow)], (ROBOT_REGIMES, ROBOT_PARTS), grouping)


def level_of(floor: np.ndarray | None, seen: Map, reference: Map | None) -> np.ndarray:
    """Return the mean square beyond which a gap lies, (g, R): the floor's, or what the reference runs show if more.

    floor: (g,) RMS; where none is known, the mean square in the regime that has the least stands in for its square.
    """
    parts = seen.means[:, : seen.parts]
    whole = np.min(np.where(np.isnan(parts), np.inf, parts), axis=1) if floor is None else floor**2
    level = np.maximum(whole, np.finfo(float).tiny)[:, None] * np.ones(len(seen.regimes))
    return np.asarray(level if reference is None else np.fmax(level, reference.means))


def heat_map(joints: Sequence[str], seen: Map, level: np.ndarray) -> ExcessMap:
    """Return the mean excess of each joint and regime, as a page draws it."""
    excess = np.nan_to_num(seen.means / level - 1)
    return ExcessMap(joints=tuple(joints), regimes=seen.regimes, excess=tuple(map(tuple, excess.tolist())))


def _made(kinds: Sequence[Sequence[Trace]]) -> tuple[list[Motion], list[np.ndarray]]:
    traces = [trace for kind in kinds for trace in kind]
    return [trace.motion for trace in traces], [trace.torque for trace in traces]


def _maps(
    kinds: Sequence[Sequence[Trace]],
    masks: Sequence[Sequence[np.ndarray]],
    regimes: tuple[tuple[str, ...], int],
    grouping: Grouping,
) -> list[Map | None]:
    maps: list[Map | None] = []
    start = 0
    for kind in kinds:
        own = [mask[start : start + len(kind)] for mask in masks]
        maps.append(Map(*regimes, *_sums(kind, own, grouping)) if kind else None)
        start += len(kind)
    return maps


def _sums(
    traces: Sequence[Trace], masks: Sequence[Sequence[np.ndarray]], grouping: Grouping
) -> tuple[np.ndarray, np.ndarray]:
    """Return squares and counts (U, g, R) by the programmed motion; few of them are cut in time."""
    labels = [grouping.label[trace.motion.run] for trace in traces]
    order = list(dict.fromkeys(labels))
    pieces = 1 if len(order) >= FEWEST_GROUPS else -(-_STRETCHES // len(order))
    squares, counts = np.zeros((2, len(order) * pieces, len(masks), masks[0][0].shape[1]))
    for k, (trace, label) in enumerate(zip(traces, labels, strict=True)):
        known = np.isfinite(trace.residual)
        left = np.where(known, trace.residual, 0.0) ** 2
        for piece, part in enumerate(np.array_split(np.arange(len(left)), pieces), order.index(label) * pieces):
            for place, mask in enumerate(masks):
                squares[piece, place] += left[part, place] @ mask[k][part]
                counts[piece, place] += known[part, place].astype(float) @ mask[k][part]
    return squares, counts


def joint_regimes(
    motions: Sequence[Motion], torques: Sequence[np.ndarray], joint: int, slow: float
) -> list[np.ndarray]:
    """Return for each motion which of `JOINT_REGIMES` a joint is in, (N, 7); torques: (N, n) as predicted, N m."""
    fastest = _largest([motion.dq[:, joint] for motion in motions])
    sharpest = _largest([motion.ddq[:, joint] for motion in motions])
    heaviest = _largest([torque[:, joint] for torque in torques])
    regimes = []
    for motion, torque in zip(motions, torques, strict=True):
        speed, acceleration = motion.dq[:, joint], motion.ddq[:, joint]
        standing = _standing(motion)[:, joint]
        near = standing | (np.abs(speed) < slow * fastest)
        steady = np.abs(acceleration) < slow * sharpest
        gaining = speed * acceleration > 0
        parts = _first_true([standing, _turning(speed, standing, near), near, steady, gaining, ~gaining])
        regimes.append(np.column_stack([parts, np.abs(torque[:, joint]) > heaviest / 2]))
    return regimes


def robot_regimes(motions: Sequence[Motion], torques: Sequence[np.ndarray], slow: float) -> list[np.ndarray]:
    """Return for each motion which of `ROBOT_REGIMES` the robot is in, (N, 7); torques: (N, n) as predicted, N m."""
    joints = range(motions[0].dq.shape[1])
    fastest = np.array([_largest([motion.dq[:, j] for motion in motions]) for j in joints])
    sharpest = np.array([_largest([motion.ddq[:, j] for motion in motions]) for j in joints])
    heaviest = np.array([_largest([torque[:, j] for torque in torques]) for j in joints])
    gains = [np.sum(motion.dq / fastest * motion.ddq / sharpest, axis=1) for motion in motions]
    powers = [np.sum(torque * motion.dq, axis=1) for motion, torque in zip(motions, torques, strict=True)]
    loads = [np.sum((torque / heaviest) ** 2, axis=1) for torque in torques]
    most_gain, most_power, most_load = _largest(gains), _largest(powers), _largest(loads)
    regimes = []
    for motion, gain, power, load in zip(motions, gains, powers, loads, strict=True):
        standing = np.asarray(_standing(motion).all(axis=1))
        parts = _first_true([standing, np.abs(gain) < slow * most_gain, gain > 0, gain <= 0])
        moved = standing & np.logical_or.accumulate(~standing)
        regimes.append(np.column_stack([parts, power < -slow * most_power, load > most_load / 2, moved]))
    return regimes


def _largest(signals: Sequence[np.ndarray]) -> float:
    return max(float(np.quantile(np.abs(np.concatenate(signals)), _LARGE)), np.finfo(float).tiny)


def _standing(motion: Motion) -> np.ndarray:
    return CoulombFriction().undecided(motion)


def _turning(speed: np.ndarray, standing: np.ndarray, near: np.ndarray) -> np.ndarray:
    """Return the samples of the stretches of slow motion, `near`, in which a joint turns round."""
    moving = np.where(standing, 0.0, np.sign(speed))
    last = np.maximum.accumulate(np.where(moving != 0, np.arange(len(speed)), 0))
    turns = moving * moving[np.concatenate([[0], last[:-1]])] < 0
    stretch = np.cumsum(np.diff(near, prepend=False))
    return np.asarray(near & np.isin(stretch, stretch[turns]))


def _first_true(masks: Sequence[np.ndarray]) -> np.ndarray:
    """Return (N, k): of k masks the first that holds."""
    stacked = np.stack(masks, axis=1)
    return np.asarray(stacked & (np.cumsum(stacked, axis=1) == 1))
