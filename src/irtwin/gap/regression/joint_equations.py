"""The equations of torque and of power in one system: real torque acts in both, a sensor's error in torque alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.effect import Effect, Predicted
from irtwin.effects.stack import Stack
from irtwin.gap.regression.candidate_columns import Below, Candidates, candidate_pattern
from irtwin.gap.regression.channel_equations import Torque, enough, with_load
from irtwin.gap.regression.cross_fitted import TwinPower
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import Variant, candidate_columns
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.progress import Tell, with_progress
from irtwin.identification.accumulate import Rows, accumulate
from irtwin.signals.motion import Motion
from irtwin.twin.identify import power_slope


@dataclass(frozen=True)
class JointEquations:
    """`whole`: the n equations of torque and, last, that of power; `torque`: the first n alone."""

    whole: System
    torque: System

    def in_torque(self, variant: Variant) -> Variant:
        """Return a variant of an effect on torque with its columns' indices among those of torque alone."""
        later = self.whole.base - self.torque.base
        moved = [
            k - later if k < self.whole.changed else k - self.whole.changed + self.torque.changed
            for k in variant.columns
        ]
        return replace(variant, columns=tuple(moved))


def joint_equations(
    stack: Stack,
    motions: Sequence[Motion],
    grouping: Grouping,
    effects: tuple[Sequence[Effect], Sequence[Effect]],
    below: Below,
    predicted: Torque,
    power: TwinPower,
    tell: Tell | None = None,
) -> JointEquations:
    """Reduce both.

    effects: candidates of torque, then of power; `below` is what those of torque are built on. Power is linear in the
    torque about what the twin predicts: the joint torque `predicted`, and the `power` that it takes; a real torque
    carries its column times the slope of power, which is the joint's speed and twice the losses of its current.
    Raises InputError where too few samples are left.
    """
    robot, (of_torque, of_power) = stack.robot, effects
    mechanical, supplied = candidate_columns(robot, of_torque), candidate_columns(robot, of_power)
    tried = candidate_pattern(robot, of_torque, mechanical)
    real = np.array([column.effect.channel == "torque" for column in mechanical], dtype=bool)
    free = tuple(pair for pair in stack.power_terms if not pair[1].fixed)
    fixed_values = power.values[stack.fixed]

    def drawn(whole: Motion) -> Predicted:
        torque = predicted(whole)
        return Predicted(torque, *power(whole, torque))

    shown = Candidates(robot, of_torque, tried, with_load(robot, below))
    added = Candidates(robot, of_power, np.ones((1, len(supplied)), dtype=bool), drawn)

    def equations(motion: Motion) -> Rows:
        own, parts, torque = stack.columns_by_joint(motion), shown.part(motion), predicted(motion)
        slope = power_slope(stack, motion, torque, power.values)
        carried = _carried(own, slope, stack.pattern, stack.real)
        now, electrical = stack.power_columns(motion, torque), added.part(motion)

        def of_power() -> list[np.ndarray]:
            return [carried, now[:, ~stack.fixed], _carried(parts, slope, tried, real), *electrical]

        shift = stack.shift(motion)
        known = now[:, stack.fixed] @ fixed_values + carried @ shift[stack.real] - (slope * torque).sum(axis=1)
        return Rows(
            [*zip(own, parts, strict=True), of_power],
            np.column_stack([stack.shift_torque(motion, own), known]),
            np.column_stack(
                [
                    np.zeros_like(motion.dq) if motion.torque is None else motion.torque,
                    np.zeros_like(known) if motion.power is None else motion.power,
                ]
            ),
            np.column_stack(
                [
                    np.ones(motion.dq.shape, bool) if motion.torque is None else stack.undecided(motion),
                    np.full(len(motion.time), motion.power is None),
                ]
            ),
        )

    pattern = _pattern(stack.pattern, tried, stack.real, real, len(free), len(supplied))
    blocks = accumulate(motions, with_progress(equations, motions, tell), pattern)
    alone = [replace(one, rows=one.rows[:-1], factors=one.factors[:-1]) for one in blocks if one.rows[:-1].any()]
    terms, columns = (*stack.torque_terms, *free), (*mechanical, *supplied)
    whole = System(
        terms,
        columns,
        pattern,
        tuple(blocks),
        *grouping.of(blocks),
        beside_power=True,
        prior_rows=stack.prior_rows(terms),
    )
    of_joints = np.concatenate([stack.pattern, tried], axis=1)
    known = stack.prior_rows(stack.torque_terms)
    torque = System(stack.torque_terms, mechanical, of_joints, tuple(alone), *grouping.of(alone), prior_rows=known)
    return JointEquations(enough(whole), enough(torque))


def _carried(rows: Sequence[np.ndarray], slope: np.ndarray, pattern: np.ndarray, real: np.ndarray) -> np.ndarray:
    """Return (N, R) the power that each real column carries: what it has in each joint's `rows`, times the slope.

    `slope` (N, n) of power over each joint's torque; `pattern` (n, K) which columns the rows have; `real` (K,).
    """
    place = np.cumsum(real) - 1
    found = np.zeros((int(real.sum()), len(slope)))
    for own, rise, used in zip(rows, np.ascontiguousarray(slope.T), pattern, strict=True):
        for column, k in zip(own.T, np.flatnonzero(used), strict=True):
            if real[k]:
                found[place[k]] += rise * column
    return found.T


def _pattern(
    own: np.ndarray, tried: np.ndarray, own_real: np.ndarray, real: np.ndarray, free: int, electrical: int
) -> np.ndarray:
    """Return the pattern (n + 1, K + L + M + E) of [torque's terms | power's | candidates of torque | of power]."""
    none, every = np.zeros((len(own), 1), dtype=bool), np.ones((1, 1), dtype=bool)
    torque = [own, none.repeat(free, 1), tried, none.repeat(electrical, 1)]
    power = [own_real[None], every.repeat(free, 1), real[None], every.repeat(electrical, 1)]
    return np.concatenate([np.concatenate(torque, axis=1), np.concatenate(power, axis=1)])
