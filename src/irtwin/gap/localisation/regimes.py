"""Regimes: ways of moving in which a gap can lie, told sample by sample.

A joint stands where its friction is undecided. It is slow, and its speed steady, below one share `slow` of the largest
speed and acceleration; it turns round while it is slow about a change of direction; it is loaded beyond half of its
largest torque. The robot's speed is steady, and power given back, by the same share.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.effects.friction import CoulombFriction
from irtwin.signals.motion import Motion

STANDSTILL, LOW_SPEED, STEADY_SPEED = "standstill", "low_speed", "steady_speed"
ACCELERATING, BRAKING, REVERSAL = "accelerating", "braking", "reversal"
LOADED, REGENERATING, AFTER_MOTION = "loaded", "regenerating", "after_motion"

JOINT_REGIMES = (STANDSTILL, REVERSAL, LOW_SPEED, STEADY_SPEED, ACCELERATING, BRAKING, LOADED)
ROBOT_REGIMES = (STANDSTILL, STEADY_SPEED, ACCELERATING, BRAKING, REGENERATING, LOADED, AFTER_MOTION)
JOINT_PARTS, ROBOT_PARTS = 6, 4  # the first of them, which part the samples; the others overlap with these

_LARGE = 0.99  # quantile that counts as a signal's largest value: a filter's ends may ring beyond it


def joint_regimes(
    motions: Sequence[Motion], torques: Sequence[np.ndarray], joint: int, slow: float
) -> list[np.ndarray]:
    """Return for each motion which of `JOINT_REGIMES` a joint is in, (N, 7); torques: (N, n) as predicted, N m."""
    fastest = _largest([motion.dq[:, joint] for motion in motions])
    sharpest = _largest([motion.ddq[:, joint] for motion in motions])
    heaviest = _largest([torque[:, joint] for torque in torques])
    found = []
    for motion, torque in zip(motions, torques, strict=True):
        speed, acceleration = motion.dq[:, joint], motion.ddq[:, joint]
        standing = _standing(motion)[:, joint]
        near = standing | (np.abs(speed) < slow * fastest)
        steady = np.abs(acceleration) < slow * sharpest
        gaining = speed * acceleration > 0
        parts = _first_true([standing, _turning(speed, standing, near), near, steady, gaining, ~gaining])
        found.append(np.column_stack([parts, np.abs(torque[:, joint]) > heaviest / 2]))
    return found


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
    found = []
    for motion, gain, power, load in zip(motions, gains, powers, loads, strict=True):
        standing = np.asarray(_standing(motion).all(axis=1))
        parts = _first_true([standing, np.abs(gain) < slow * most_gain, gain > 0, gain <= 0])
        moved = standing & np.logical_or.accumulate(~standing)
        found.append(np.column_stack([parts, power < -slow * most_power, load > most_load / 2, moved]))
    return found


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
