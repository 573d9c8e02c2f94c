"""The equations of torque and of power, with every candidate effect's columns beside those of the twin."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.compliance import load_inertia, load_torque
from irtwin.effects.effect import Effect, Predicted
from irtwin.effects.friction import turning
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.regression.candidate_columns import Below, Candidates, candidate_pattern
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import candidate_columns
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.accumulate import Equations, Rows, accumulate, accumulate_any
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

Torque = Callable[[Motion], np.ndarray]
Pairs = Sequence[tuple[Motion, Motion]]  # motions, each with the same once more, shaken


def torque_system(
    stack: Stack,
    motions: Sequence[Motion],
    grouping: Grouping,
    effects: Sequence[Effect],
    below: Below | None,
    shaken: Pairs = (),
    every: int = 1,
) -> System:
    """Reduce the equations of measured torque; `below` gives over a whole run what candidates are built on.

    `shaken` says what noise of positions does to them; `every`: of which stretches, as `accumulate` takes it.
    Raises InputError where too few samples are left.
    """
    robot = stack.robot
    columns = candidate_columns(robot, effects)
    tried = candidate_pattern(robot, effects, columns)
    pattern = np.concatenate([stack.pattern, tried], axis=1)

    def equations() -> Equations:
        candidates = Candidates(robot, effects, tried, below or _nothing, in_order=every == 1)

        def of_part(motion: Motion) -> Rows:
            assert motion.torque is not None
            own = stack.columns_by_joint(motion)
            columns = list(zip(own, candidates.part(motion), strict=True))
            return Rows(
                columns,
                stack.shift_torque(motion),
                motion.torque,
                stack.undecided(motion),
                turning(robot, motion.dq),
            )

        return of_part

    blocks = accumulate(motions, equations(), pattern, by_products=bool(effects), every=every)
    told = [pair for pair in shaken if pair[0].torque is not None]
    noise = shaken_products(told, equations(), equations(), pattern, len(stack.torque_terms))
    known = stack.prior_rows(stack.torque_terms)
    system = System(stack.torque_terms, columns, pattern, tuple(blocks), *grouping.of(blocks), prior_rows=known)
    return enough(replace(system, **vars(noise)) if noise else system)


def power_system(
    stack: Stack,
    motions: Sequence[Motion],
    grouping: Grouping,
    effects: Sequence[Effect],
    predicted: Torque,
    power_of: Callable[[Motion, np.ndarray], tuple[np.ndarray, np.ndarray]],
) -> System:
    """Reduce the equation of measured power, on top of the joint torque that is predicted."""
    robot = stack.robot
    columns = candidate_columns(robot, effects)
    free = tuple(pair for pair in stack.power_terms if not pair[1].fixed)
    pattern = np.ones((1, len(free) + len(columns)), dtype=bool)
    fixed_values = np.array([term.expected for _, term in stack.power_terms])[stack.fixed]

    def below(whole: Motion) -> Predicted:
        torque = predicted(whole)
        return Predicted(torque, *power_of(whole, torque))

    candidates = Candidates(robot, effects, np.ones((1, len(columns)), dtype=bool), below)

    def equations(motion: Motion) -> Rows:
        assert motion.power is not None
        own = stack.power_columns(motion, predicted(motion))
        known = own[:, stack.fixed] @ fixed_values
        columns = [own[:, ~stack.fixed], *candidates.part(motion)]
        return Rows([columns], known[:, None], motion.power[:, None])

    blocks = accumulate(motions, equations, pattern, by_products=bool(effects))
    known = stack.prior_rows(free)
    return enough(System(free, columns, pattern, tuple(blocks), *grouping.of(blocks), prior_rows=known))


def with_load(robot: Robot, below: Below) -> Below:
    """Return what candidates of torque are built on, with what the links take beyond the gears, kept for each run."""
    held: dict[str, tuple[Motion, Predicted]] = {}

    def loaded(whole: Motion) -> Predicted:
        if whole.run not in held or held[whole.run][0] is not whole:
            before = below(whole)
            load, inertia = load_torque(robot, whole, before), load_inertia(robot, whole, before)
            held[whole.run] = whole, replace(before, load=load, inertia=inertia)
        return held[whole.run][1]

    return loaded


def _nothing(whole: Motion) -> Predicted:
    raise AssertionError("candidates are built on what the twin predicts")


def enough(system: System) -> System:
    """Return the system; raise InputError where its samples are so few that the twin would fit whatever they say."""
    samples = int(system.rows.sum())
    if samples <= system.base:
        raise InputError(
            f"{samples} samples are left of all runs to find {system.base} coefficients of the twin, which would fit "
            "whatever they say; log longer runs"
        )
    return system


@dataclass(frozen=True)
class Shaking:
    """What shaking changes, as `System` has it."""

    shaken: tuple[np.ndarray, ...]
    shaken_twin: tuple[np.ndarray, ...]


def shaken_products(
    pairs: Pairs, equations: Equations, again: Equations, pattern: np.ndarray, twin: int
) -> Shaking | None:
    """Return each equation's products a row of what shaking changes; None where there is no pair.

    `pattern`: (g, K) which columns each has, the `twin`'s first; the last is the measurement's, less what is known.
    `equations` are of the motions as they are, `again` the same of shaken ones.
    """
    if not pairs:
        return None
    partner = {id(motion): other for motion, other in pairs}

    def difference(motion: Motion) -> Rows:
        whole = partner[id(motion.whole or motion)]
        first, second = equations(motion), again(whole.part(motion.start, motion.start + len(motion.time)))
        columns = [
            [b - a for a, b in zip(first.dense(k, used), second.dense(k, used), strict=True)]
            for k, used in enumerate(pattern)
        ]
        undecided = None
        if first.undecided is not None and second.undecided is not None:
            undecided = first.undecided | second.undecided
        return Rows(columns, second.known - first.known, np.zeros_like(first.measured), undecided, first.slow)

    whole = [np.zeros((size, size)) for size in np.tile(pattern.sum(axis=1) + 1, 2)]
    rows = np.zeros(len(whole))
    for motion, _ in pairs:  # one by one: blocks of all together take many times what their products do
        blocks = [block.apart for block in accumulate_any([motion], difference, pattern, by_products=True)]
        rows += sum(block.rows for block in blocks)
        for total, *factors in zip(whole, *(block.factors for block in blocks), strict=True):
            total += _products(factors)
    shaken = tuple(total / max(count, 1.0) for total, count in zip(whole, rows, strict=True))
    own = [np.append(np.arange(count), -1) for count in pattern[:, :twin].sum(axis=1)] * 2
    return Shaking(shaken, tuple(products[np.ix_(some, some)] for products, some in zip(shaken, own, strict=True)))


def _products(factors: Sequence[np.ndarray]) -> np.ndarray:
    """Return the products of columns of all rows (N, k) each; few rows are taken together: each sum takes as long."""
    bunches: dict[int, list[np.ndarray]] = {}
    rows = 0
    for factor in factors:
        bunches.setdefault(rows // factor.shape[1], []).append(factor)
        rows += len(factor)
    return np.asarray(sum(stacked.T @ stacked for stacked in map(np.concatenate, bunches.values())))
