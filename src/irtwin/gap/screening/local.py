"""Worn spots, and springs near the end of a joint's way: their place, from what the twin leaves over the joint's angle.

The residual is summed in cells of angle and direction, so that a shape costs next to nothing. The best place of each is
tried; whether there is anything in it, the search decides.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.effects.friction import sharp_sign
from irtwin.effects.local import LocalEffect
from irtwin.gap.screening.remainder import RunResidual
from irtwin.identification.progress import track
from irtwin.robot.description import Robot

_CELLS = 160  # of angle over a joint's way, in either direction: four for the width of the narrowest bump
_SLOW = (0.03, 0.15)  # of the joint's largest speed: over so much, friction that sticks lets go


def local_effects(robot: Robot, effects: Sequence[LocalEffect], left: Sequence[RunResidual]) -> Iterator[LocalEffect]:
    """Yield each effect at each joint that moves, in the places that explain most of what is left in observed runs."""
    observed = [run for run in left if run.observed]
    for k, joint in track(enumerate(robot.joints), lambda numbered: f"places of {numbered[1].name}"):
        passed = _Passed.of(observed, k) if observed else None
        if passed is None:
            continue
        for effect in effects:
            lowest = effect.joint_terms(joint)[0].lowest
            for group in effect.over(*passed.way):
                explained = passed.explained(group, lowest)
                if explained.max() > 0:
                    yield group[int(np.argmax(explained))].on(joint.name)


@dataclass(frozen=True)
class _Passed:
    """What is left of a joint's torque in C cells of angle and direction: `sums` (C,), and `count` (C,) of samples.

    `way`: from where to where it goes; `smooth` (C, m): what a bump is judged beside.
    """

    way: tuple[float, float]
    angle: np.ndarray
    sign: np.ndarray
    count: np.ndarray
    sums: np.ndarray
    smooth: np.ndarray

    @classmethod
    def of(cls, left: Sequence[RunResidual], joint: int) -> _Passed | None:
        """Sum the joint's residual; None where it does not move, or nothing is left."""
        q, dq, ddq, residual = (
            np.concatenate([values[:, joint] for values in arrays])
            for arrays in zip(*((m.motion.q, m.motion.dq, m.motion.ddq, m.residual) for m in left), strict=True)
        )
        moving = np.isfinite(residual) & (sharp_sign(dq) != 0)
        if not moving.any() or np.ptp(q[moving]) == 0:
            return None
        q, dq, ddq, residual = q[moving], dq[moving], ddq[moving], residual[moving]
        residual = _beside_friction(q, dq, ddq, residual)
        lower, upper = float(q.min()), float(q.max())
        place = np.minimum((q - lower) / (upper - lower) * _CELLS, _CELLS - 1).astype(int) + _CELLS * (dq > 0)
        cell = np.arange(2 * _CELLS)
        angle = lower + (cell % _CELLS + 0.5) / _CELLS * (upper - lower)
        sign = np.where(cell < _CELLS, -1.0, 1.0)
        sums = np.bincount(place, residual, 2 * _CELLS)
        count = np.bincount(place, minlength=2 * _CELLS).astype(float)
        return cls((lower, upper), angle, sign, count, sums, _over_angle(angle, sign))

    def explained(self, shapes: Sequence[LocalEffect], lowest: float) -> np.ndarray:
        """Return (S,) the squares that shapes explain beside what goes smoothly with the angle.

        `lowest`: the least that their coefficient can be.
        """
        columns = np.stack([shape.law(self.angle, self.sign) for shape in shapes], axis=1)
        weighted = self.smooth * self.count[:, None]
        normal = self.smooth.T @ weighted
        columns = columns - self.smooth @ np.linalg.lstsq(normal, weighted.T @ columns, rcond=None)[0]
        score = self.sums @ columns
        if lowest >= 0:
            score = np.maximum(score, 0.0)
        return np.asarray(score**2 / np.maximum(self.count @ columns**2, 1e-12))


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
