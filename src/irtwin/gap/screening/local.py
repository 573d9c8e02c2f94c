"""Worn spots, and springs near the end of a joint's way: their place, from what the twin leaves over the joint's angle.

The residual is summed in cells of angle and direction, stretch by stretch of time, so that a shape costs next to
nothing. Chance is what random signs of stretches reach, at any joint and in any shape; a stretch is longer than the
residual remembers.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.effects.friction import sharp_sign
from irtwin.effects.local import LocalEffect
from irtwin.gap.regression.correlation import correlation_samples
from irtwin.gap.screening.remainder import Remainder
from irtwin.gap.thresholds import Local
from irtwin.identification.progress import Tell, paced
from irtwin.robot.description import Joint, Robot

_CELLS = 160  # of angle over a joint's way, in either direction: four for the width of the narrowest bump
_FLIPS = 999
_MEMORIES = 2.0  # times which the residual remembers, in a stretch,
_SHORTEST = 1.0  # s, which a stretch lasts at least: to pass a place is one event
_SLOW = (0.03, 0.15)  # of the joint's largest speed: over so much, friction that sticks lets go


def local_effects(
    robot: Robot,
    effects: Sequence[LocalEffect],
    left: Sequence[Remainder],
    limits: Local,
    seed: int,
    tell: Tell | None = None,
) -> list[LocalEffect]:
    """Return each effect at the joints, and in the place, where what is left in observed runs stands out.

    `tell` is told how far that has come, where it takes long.
    """
    observed = [one for one in left if one.observed]
    if not observed:
        return []
    stretches = _stretches(observed, max(_MEMORIES * max(map(_memory, observed)), _SHORTEST))
    count = 1 + int(stretches[-1][-1])
    signs = np.random.default_rng(seed).choice([-1.0, 1.0], (_FLIPS, count))
    every = [(joint, _Passed.of(observed, stretches, k, count)) for k, joint in enumerate(robot.joints)]
    joints = [(joint, passed) for joint, passed in every if passed]
    return [place for effect in effects for place in _places(effect, joints, signs, limits, paced(tell))]


def _places(
    effect: LocalEffect, joints: Sequence[tuple[Joint, _Passed]], signs: np.ndarray, limits: Local, told: Tell
) -> Iterator[LocalEffect]:
    """Yield the shape that explains most, if enough, of each group at each joint of which one is beyond chance."""
    tried = []
    for joint, passed in joints:
        told(f"  {effect.id.replace('_', ' ')} of {joint.name}")
        lowest = effect.joint_terms(joint)[0].lowest
        tried += [(joint.name, group, passed.judged(group, signs, lowest)) for group in effect.over(*passed.way)]
    reached = np.max([judged.reached for _, _, judged in tried], axis=0, initial=0.0)
    for name, group, judged in tried:
        p = (1 + np.sum(reached >= judged.t.max())) / (1 + len(signs))
        share = np.where(judged.t >= limits.least_t, judged.share, 0.0)
        best = int(np.argmax(share))
        if p <= limits.alpha and share[best] >= limits.least_share:
            yield group[best].on(name)


@dataclass(frozen=True)
class _Judged:
    """Of S shapes: the share of the squares that each explains, its t, and the largest t under each random sign."""

    share: np.ndarray
    t: np.ndarray
    reached: np.ndarray


@dataclass(frozen=True)
class _Passed:
    """What is left of a joint's torque in C cells of angle and direction: `sums` (B, C) of each stretch, `count` (C,).

    `way`: from where to where it goes; `square`: of all that is left; `smooth` (C, m): what a bump is judged beside.
    """

    way: tuple[float, float]
    angle: np.ndarray
    sign: np.ndarray
    count: np.ndarray
    sums: np.ndarray
    square: float
    smooth: np.ndarray

    @classmethod
    def of(cls, left: Sequence[Remainder], stretches: Sequence[np.ndarray], joint: int, count: int) -> _Passed | None:
        """Sum the joint's residual; None where it does not move, or nothing is left."""
        q, dq, ddq, residual = (
            np.concatenate([values[:, joint] for values in each])
            for each in zip(*((m.motion.q, m.motion.dq, m.motion.ddq, m.residual) for m in left), strict=True)
        )
        moving = np.isfinite(residual) & (sharp_sign(dq) != 0)
        if not moving.any():
            return None
        q, dq, ddq, residual = q[moving], dq[moving], ddq[moving], residual[moving]
        residual = _beside_friction(q, dq, ddq, residual)
        lower, upper = float(q.min()), float(q.max())
        square = float(residual @ residual)
        if square == 0.0 or upper == lower:
            return None
        place = np.minimum((q - lower) / (upper - lower) * _CELLS, _CELLS - 1).astype(int) + _CELLS * (dq > 0)
        cell = np.arange(2 * _CELLS)
        angle = lower + (cell % _CELLS + 0.5) / _CELLS * (upper - lower)
        sign = np.where(cell < _CELLS, -1.0, 1.0)
        stretch = np.concatenate(stretches)[moving]
        sums = np.bincount(stretch * 2 * _CELLS + place, residual, count * 2 * _CELLS).reshape(count, -1)
        return cls(
            (lower, upper),
            angle,
            sign,
            np.bincount(place, minlength=2 * _CELLS).astype(float),
            sums,
            square,
            _over_angle(angle, sign),
        )

    def judged(self, shapes: Sequence[LocalEffect], signs: np.ndarray, lowest: float) -> _Judged:
        """Judge shapes by what they explain beside what goes smoothly with the angle.

        `signs` (F, B): chance's; `lowest`: the least that their coefficient can be.
        """
        columns = np.stack([shape.law(self.angle, self.sign) for shape in shapes], axis=1)
        weighted = self.smooth * self.count[:, None]
        normal = self.smooth.T @ weighted
        columns = columns - self.smooth @ np.linalg.lstsq(normal, weighted.T @ columns, rcond=None)[0]
        scores = self.sums @ columns
        size = np.maximum(self.count @ columns**2, 1e-12)
        total, spread = scores.sum(axis=0), np.maximum(np.sqrt((scores**2).sum(axis=0)), 1e-12)
        t, flipped = total / spread, signs @ scores / spread
        if lowest >= 0:
            return _Judged(np.maximum(total, 0.0) ** 2 / size / self.square, t, flipped.max(axis=1))
        return _Judged(total**2 / size / self.square, np.abs(t), np.abs(flipped).max(axis=1))


def _beside_friction(q: np.ndarray, dq: np.ndarray, ddq: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """Return what is left (N,) beside friction of any smooth form over speed, inertia, and what goes with the angle."""
    sign, fastest = np.sign(dq), np.abs(dq).max()
    over_speed = [dq, np.abs(dq), sign * dq**2, *(sign * np.exp(-np.abs(dq) / (share * fastest)) for share in _SLOW)]
    columns = np.column_stack([*over_speed, ddq, _over_angle(q, sign)])
    return np.asarray(residual - columns @ np.linalg.lstsq(columns, residual, rcond=None)[0])


def _over_angle(q: np.ndarray, sign: np.ndarray) -> np.ndarray:
    """Return (N, 6): offset and gravity; friction that is the same everywhere, or varies over a turn.

    No spring about an anchor: most of a one-sided one is that, and the search tells them apart.
    """
    turn = np.column_stack([np.ones_like(q), np.cos(q), np.sin(q)])
    return np.concatenate([turn, sign[:, None] * turn], axis=1)


def _memory(one: Remainder) -> float:
    """Return for how long the residual remembers, s: the joints' median."""
    return float(np.median([correlation_samples(column) for column in one.residual.T])) / one.motion.rate


def _stretches(left: Sequence[Remainder], length: float) -> list[np.ndarray]:
    """Return (N,) for each run in which stretch each sample is, so many seconds long; numbered through all runs."""
    found, first = [], 0
    for one in left:
        time = one.motion.time - one.motion.time[0]
        number = np.floor(time / length).astype(int)
        found.append(first + number)
        first += int(number[-1]) + 1
    return found
