"""The equations of torque and of power in one system: real torque acts in both, a sensor's error in torque alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from irtwin.effects.effect import Effect, Predicted
from irtwin.effects.friction import turning
from irtwin.effects.stack import Stack
from irtwin.gap.regression.candidate_columns import Below, Candidates, candidate_pattern
from irtwin.gap.regression.channel_equations import Pairs, Torque, enough, shaken_products
from irtwin.gap.regression.cross_fitted import TwinPower
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import Variant, candidate_columns
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.accumulate import Equations, Given, Rows, accumulate
from irtwin.identification.power_line import carried, power_line, rows_of_both
from irtwin.signals.motion import Motion


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

    def with_noise_of(self, other: JointEquations) -> JointEquations:
        """Return them with what noise of positions does to others, which have these columns and more."""
        whole = self.whole.with_noise_of(other.whole)
        return JointEquations(whole, replace(self.torque, shaken_twin=other.torque.shaken_twin))

    def in_whole(self, column: int) -> int:
        """Return the index of a candidate column of torque alone among those of both."""
        if column < self.torque.changed:
            return column + self.whole.base - self.torque.base
        return column - self.torque.changed + self.whole.changed


def joint_equations(
    stack: Stack,
    motions: Sequence[Motion],
    grouping: Grouping,
    effects: tuple[Sequence[Effect], Sequence[Effect]],
    below: Below,
    predicted: Torque,
    power: TwinPower,
    shaken: Pairs = (),
    every: int = 1,
) -> JointEquations:
    """Reduce both.

    effects: candidates of torque, then of power; `below` is what those of torque are built on. Power is linear in the
    torque about what the twin predicts: the joint torque `predicted`, and the `power` that it takes; a real torque
    carries its column times the slope of power, which is the joint's speed and twice the losses of its current.
    `shaken` says what noise of positions does to them; `every`: of which stretches, as `accumulate` takes it.
    Raises InputError where too few samples are left.
    """
    robot, (of_torque, of_power) = stack.robot, effects
    mechanical, supplied = candidate_columns(robot, of_torque), candidate_columns(robot, of_power)
    tried = candidate_pattern(robot, of_torque, mechanical)
    real = np.array([column.effect.channel == "torque" for column in mechanical], dtype=bool)
    free = tuple(pair for pair in stack.power_terms if not pair[1].fixed)

    def drawn(whole: Motion) -> Predicted:
        torque = predicted(whole)
        return Predicted(torque, *power(whole, torque))

    def equations() -> Equations:
        shown = Candidates(robot, of_torque, tried, below, in_order=every == 1)
        added = Candidates(robot, of_power, np.ones((1, len(supplied)), dtype=bool), drawn, in_order=every == 1)

        def of_part(motion: Motion) -> Rows:
            own, parts, torque = stack.columns_by_joint(motion), shown.part(motion), predicted(motion)
            carrying = partial(carried, own, pattern=stack.pattern, real=stack.real)
            about = torque, stack.power_columns(motion, torque), power.values, stack.told_by_log(motion)
            line = power_line(stack, motion, carrying, *about)
            electrical = added.part(motion)

            def of_power() -> list[np.ndarray]:
                return [line.carried, line.free, carried(parts, line.slope, tried, real), *electrical]

            rows: list[Given] = [*zip(own, parts, strict=True), of_power]
            of_both = rows_of_both(stack, motion, rows, (stack.shift_torque(motion), line.known))
            return replace(of_both, slow=np.pad(turning(robot, motion.dq), ((0, 0), (0, 1))))

        return of_part

    pattern = _pattern(stack.pattern, tried, stack.real, real, len(free), len(supplied))
    blocks = accumulate(motions, equations(), pattern, by_products=True, every=every)
    alone = [block.of(slice(-1)) for block in blocks if block.rows[:-1].any()]
    terms, columns = (*stack.torque_terms, *free), (*mechanical, *supplied)
    noise = shaken_products(shaken, equations(), equations(), pattern, len(terms))
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
    if noise:
        fast_and_slow = (*noise.shaken_twin[: len(tried)], *noise.shaken_twin[len(pattern) : -1])
        whole, torque = replace(whole, **vars(noise)), replace(torque, shaken_twin=fast_and_slow)
    return JointEquations(enough(whole), enough(torque))


def _pattern(
    own: np.ndarray, tried: np.ndarray, own_real: np.ndarray, real: np.ndarray, free: int, electrical: int
) -> np.ndarray:
    """Return the pattern (n + 1, K + L + M + E) of [torque's terms | power's | candidates of torque | of power]."""
    none, every = np.zeros((len(own), 1), dtype=bool), np.ones((1, 1), dtype=bool)
    torque = [own, none.repeat(free, 1), tried, none.repeat(electrical, 1)]
    power = [own_real[None], every.repeat(free, 1), real[None], every.repeat(electrical, 1)]
    return np.concatenate([np.concatenate(torque, axis=1), np.concatenate(power, axis=1)])
