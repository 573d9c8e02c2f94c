"""Regimes: ways of moving in which a gap can lie, told sample by sample."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.thresholds import Regimes
from irtwin.signals.motion import Motion

STANDSTILL, LOW_SPEED, STEADY_SPEED = "standstill", "low_speed", "steady_speed"
ACCELERATING, BRAKING, REVERSAL = "accelerating", "braking", "reversal"
LOADED, REGENERATING, AFTER_MOTION = "loaded", "regenerating", "after_motion"

JOINT_REGIMES = (STANDSTILL, LOW_SPEED, STEADY_SPEED, ACCELERATING, BRAKING, REVERSAL, LOADED)
ROBOT_REGIMES = (STANDSTILL, STEADY_SPEED, ACCELERATING, BRAKING, REGENERATING, LOADED, AFTER_MOTION)
JOINT_PARTS, ROBOT_PARTS = 6, 4  # the first of them, which part the samples; the others overlap with these

_LARGE = 0.99  # quantile that counts as a signal's largest value: a filter's ends may ring beyond it


def joint_regimes(
    motions: Sequence[Motion], torques: Sequence[np.ndarray], joint: int, limits: Regimes
) -> list[np.ndarray]:
    """Return for each motion which of `JOINT_REGIMES` a joint is in, (N, 7); torques: (N, n) as predicted, N m."""
    fastest = _largest([motion.dq[:, joint] for motion in motions])
    sharpest = _largest([motion.ddq[:, joint] for motion in motions])
    heaviest = _largest([torque[:, joint] for torque in torques])
    found = []
    for motion, torque in zip(motions, torques, strict=True):
        speed, acceleration = motion.dq[:, joint], motion.ddq[:, joint]
        standing = _standing(motion, limits.standing)[:, joint]
        turning = _around_reversals(speed, standing, max(1, round(limits.reversal * motion.rate)))
        slow = np.asarray(np.abs(speed) < limits.slow * fastest)
        steady = np.asarray(np.abs(acceleration) < limits.steady * sharpest)
        gaining = speed * acceleration > 0
        taken = _first_true([turning, standing, slow, steady, gaining, ~gaining])
        parts = [taken[:, place] for place in (1, 2, 3, 4, 5, 0)]
        found.append(np.stack([*parts, np.abs(torque[:, joint]) > limits.loaded * heaviest], axis=1))
    return found


def robot_regimes(motions: Sequence[Motion], torques: Sequence[np.ndarray], limits: Regimes) -> list[np.ndarray]:
    """Return for each motion which of `ROBOT_REGIMES` the robot is in, (N, 7); torques: (N, n) as predicted, N m."""
    joints = range(motions[0].dq.shape[1]) if motions else range(0)
    fastest = np.array([_largest([motion.dq[:, j] for motion in motions]) for j in joints])
    sharpest = np.array([_largest([motion.ddq[:, j] for motion in motions]) for j in joints])
    heaviest = np.array([_largest([torque[:, j] for torque in torques]) for j in joints])
    gains = [np.sum(motion.dq / fastest * motion.ddq / sharpest, axis=1) for motion in motions]
    powers = [np.sum(torque * motion.dq, axis=1) for motion, torque in zip(motions, torques, strict=True)]
    loads = [np.sum((torque / heaviest) ** 2, axis=1) for torque in torques]
    most_gain, most_power, most_load = _largest(gains), _largest(powers), _largest(loads)
    found = []
    for motion, gain, power, load in zip(motions, gains, powers, loads, strict=True):
        standing = np.asarray(_standing(motion, limits.standing).all(axis=1))
        even = np.asarray(np.abs(gain) < limits.even * most_gain)
        parts = _first_true([standing, even, np.asarray(gain > 0), np.asarray(gain <= 0)])
        since = motion.time - np.maximum.accumulate(np.where(standing, -np.inf, motion.time))
        overlapping = [
            power < -limits.regenerating * most_power,
            load > limits.loaded * most_load,
            standing & (since <= limits.after_motion),
        ]
        found.append(np.column_stack([parts, *overlapping]))
    return found


def _largest(signals: Sequence[np.ndarray]) -> float:
    values = np.abs(np.concatenate([np.zeros(1), *signals]))
    return max(float(np.quantile(values, _LARGE)), np.finfo(float).tiny)


def _standing(motion: Motion, least: float) -> np.ndarray:
    slow = np.abs(motion.dq) < least
    return np.asarray(slow if motion.standing is None else motion.standing | slow)


def _around_reversals(speed: np.ndarray, standing: np.ndarray, reach: int) -> np.ndarray:
    """Return the samples within `reach` of one where a joint turns round."""
    moving = np.where(standing, 0.0, np.sign(speed))
    last = np.maximum.accumulate(np.where(moving != 0, np.arange(len(speed)), 0))
    turns = np.flatnonzero(moving * moving[np.concatenate([[0], last[:-1]])] < 0)
    around = np.zeros(len(speed) + 1)
    np.add.at(around, np.maximum(turns - reach, 0), 1)
    np.add.at(around, np.minimum(turns + reach, len(speed)), -1)
    return np.asarray(np.cumsum(around)[:-1] > 0)


def _first_true(masks: Sequence[np.ndarray]) -> np.ndarray:
    """Return (N, k): of k masks the first that holds."""
    stacked = np.stack(masks, axis=1)
    return np.asarray(stacked & (np.cumsum(stacked, axis=1) == 1))
