"""The fits of a robot's effects to what was measured: to torque, to power on top of it, to both, to power alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from irtwin.effects.drive import CopperLoss
from irtwin.effects.effect import Effect, Term
from irtwin.effects.stack import Stack, expected
from irtwin.identification.accumulate import Block, Columns, Equations, Rows, accumulate, accumulate_any, part_read
from irtwin.identification.estimators import Estimate, estimate, estimate_one
from irtwin.identification.power_line import PowerLine, power_line, power_rows, rise_over_axes, rows_of_both
from irtwin.identification.reduced_torque import ReducedTorque
from irtwin.signals.motion import Motion

Terms = Sequence[tuple[Effect, Term]]

_STEPS = 20  # of Gauss-Newton, at most
_CONVERGED = 1e-3  # of the prior spread
_SETTLED = 0.1  # of a standard deviation: closer to it, a further step says nothing that the data know
_REPEATS = 8  # of fit and prediction, at most
_SCALE = Term("scale", "1", spread=0.05)  # of real over logged torque, less one: drives' constants are nominal


def fit_torque(
    stack: Stack, motions: Sequence[Motion], known: ReducedTorque | None = None
) -> tuple[list[Block], Estimate]:
    """Fit the coefficients of torque to measured torque; return them with the equations, reduced.

    `known`: such equations of all these motions, if they were reduced before.
    """
    terms, prior = _of(stack.torque_terms), stack.prior_rows(stack.torque_terms)
    reduced = None if known is None else known.of(stack)

    def fit(values: np.ndarray | None) -> tuple[list[Block], Estimate]:
        def equations(motion: Motion) -> Rows:
            assert motion.torque is not None
            shifted = stack.shift_torque(motion, sparse=True)
            return Rows(stack.sparse_by_joint(motion, values), shifted, motion.torque, stack.undecided(motion))

        blocks = reduced or accumulate(motions, equations, stack.pattern)
        return blocks, estimate(blocks, stack.pattern, terms, prior)

    blocks, fitted = fit(_alone(stack, motions, known) if stack.coupled else None)
    for _ in range(_REPEATS if stack.coupled else 0):
        before = fitted.values
        blocks, fitted = fit(before)
        if _converged(fitted.values, before, terms):
            break
    return blocks, fitted


def fit_power(
    stack: Stack, motions: Sequence[Motion], torque_values: np.ndarray, every: int = 1, *, switching: bool = False
) -> tuple[list[Block], Estimate]:
    """Fit the free coefficients of power on the torque that was logged, as `fit_torque` returns them.

    What sensors add is taken off, by the coefficients that were found; where none was logged it is the predicted one.
    On the predicted one, what laws of friction miss would be heat of drives. `every` as in `accumulate`; `switching`:
    moments at which brakes open or close count, too, as they tell when.
    """
    free = free_terms(stack)

    def fit(values: np.ndarray) -> tuple[list[Block], Estimate]:
        equations = _losses_equations(stack, torque_values, values, logged=True, switching=switching)
        return estimate_one(motions, equations, _of(free), stack.prior_rows(free), every)

    values = expected(stack.power_terms)
    blocks, fitted = fit(values)
    for _ in range(_REPEATS if stack.power_coupled else 0):
        step = np.abs(fitted.values - values[~stack.fixed]) / np.sqrt(np.diag(fitted.covariance))
        if step.max(initial=0.0) < _SETTLED:
            break
        values = values.copy()
        values[~stack.fixed] = fitted.values
        blocks, fitted = fit(values)
    return blocks, fitted


def predicted_losses(
    stack: Stack, motions: Sequence[Motion], torque_values: np.ndarray, free_values: np.ndarray
) -> list[Block]:
    """Return the equations of power on the torque that is predicted, reduced, about free coefficients of power."""
    values = expected(stack.power_terms)
    values[~stack.fixed] = free_values
    equations = _losses_equations(stack, torque_values, values, logged=False)
    return accumulate(motions, equations, np.ones((1, len(free_values)), dtype=bool))


def _losses_equations(
    stack: Stack, torque_values: np.ndarray, values: np.ndarray, *, logged: bool, switching: bool = False
) -> Equations:
    """Return the equation of power in its free coefficients, about coefficients of power `values` (L,)."""
    torque_of = stack.logged_torque if logged else stack.real_torque

    def equations(motion: Motion) -> Rows:
        assert motion.power is not None
        torque = torque_of(motion, torque_values, sparse=True)
        columns = stack.predicted_power_columns(motion, torque_values, values, torque, logged=logged)
        burnt = _burnt(stack, motion, torque, columns, values)
        known = columns[:, stack.fixed] @ expected(stack.power_terms)[stack.fixed]
        known -= burnt[:, ~stack.fixed] @ values[~stack.fixed]
        unsure = None if switching or (near := stack.switching(motion)) is None else near[:, None]
        return Rows((columns + burnt)[:, None, ~stack.fixed], known[:, None], motion.power[:, None], unsure)

    return equations


def _burnt(stack: Stack, motion: Motion, torque: np.ndarray, columns: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return by how much less columns of power (N, L) count, as what the axes give back is burnt: (N, L).

    By Gauss-Newton, about the coefficients `values` (L,). Without it heat in joints that give back would count where
    none of it is drawn.
    """
    if not stack.power_coupled:
        return np.zeros_like(columns)
    on_bus = columns * stack.on_the_bus
    axes, rise = on_bus @ values, np.zeros(len(columns))
    for effect in dict.fromkeys(effect for effect, _ in stack.power_terms):
        own = [owner is effect for owner, _ in stack.power_terms]
        rise += rise_over_axes(stack, effect, motion, torque, axes, values[own])
    return np.asarray(rise[:, None] * on_bus)


def fit_both(
    stack: Stack, motions: Sequence[Motion], torque_values: np.ndarray, of_torque: Sequence[Block] | None = None
) -> Estimate:
    """Fit the coefficients of torque to torque and power at once, starting from those that torque alone gives.

    A real torque acts in both signals, what a sensor shows in torque alone. Power is linear about the torque that is
    predicted, by Gauss-Newton. Each signal is weighed by its own residual, and by how long that remembers. So that what
    the twin lacks of power does not look like friction, heat of windings and how real work stands to that of logged
    torque are found beside, and samples in which the joints give power back are left out of power: it may be burnt.
    `of_torque`: the equations of torque of all these motions, if they were reduced before.

    Of a long log a part is read until that settles, and then all, from values so near that the next step is known to be
    none: steps shrink as they did before.
    """
    if CopperLoss.id not in stack.ids:
        stack = stack.with_effects([*stack.effects, CopperLoss()])
    every = part_read(motions)
    power = fit_power(stack, [motion for motion in motions if motion.power is not None], torque_values, every)[1]
    free, count = free_terms(stack), len(stack.torque_terms)
    terms = [*_of(stack.torque_terms), *_of(free), _SCALE]
    known = stack.prior_rows([*stack.torque_terms, *free])
    if known is not None:
        known = np.pad(known, (0, 1))
        known[-1, -1] = 1.0
    joints = len(stack.pattern)
    pattern = np.ones((joints + 1, len(terms)), dtype=bool)
    pattern[:joints] = np.pad(stack.pattern, ((0, 0), (0, len(free) + 1)))
    pattern[joints, :count] = stack.real
    values = np.concatenate([torque_values, power.values, [0.0]])
    step, shrinks = np.inf, 1.0
    for _ in range(_STEPS):
        if of_torque is None or stack.coupled:
            blocks = accumulate(motions, _both_equations(stack, values), pattern, every=every)
            of_torque = blocks if every == 1 else of_torque
        else:  # that of power alone follows the values
            line = _both_equations(stack, values, power_alone=True)
            blocks = _beside(of_torque, accumulate_any(motions, line, pattern[joints:], every=every), pattern)
        fitted = estimate(blocks, pattern, terms, known, signals=[0] * joints + [1])
        before, values, last = values, fitted.values, step
        step = float(np.max((np.abs(values - before) / np.sqrt(np.diag(fitted.covariance)))[:count], initial=0.0))
        if every == 1 and shrinks * step < _SETTLED:
            break
        if every > 1 and step < min(last, _SETTLED):
            every, shrinks = 1, step / last if np.isfinite(last) else 1.0
    return fitted.of(range(count), fitted.noise[:joints])


def _both_equations(stack: Stack, values: np.ndarray, *, power_alone: bool = False) -> Equations:
    """Return the equations of torque and of power about the coefficients of torque, of power, and the scale.

    `power_alone`: the last of them alone. Power does not hold where what joints give back may be burnt, and where
    brakes are about to switch.
    """
    torque_values, free, scale = np.split(values, [len(stack.torque_terms), len(values) - 1])
    fixed_values = expected(stack.power_terms)[stack.fixed]
    power_values = np.empty(len(stack.power_terms))
    power_values[stack.fixed], power_values[~stack.fixed] = (1 + scale) * fixed_values, free

    def equations(motion: Motion) -> Rows:
        line, drawn = _line(stack, motion, torque_values, power_values)
        work, near = drawn[:, stack.fixed] @ fixed_values, stack.switching(motion)
        unsure = work < 0 if near is None else (work < 0) | near
        of_power = [*line.carried, line.free, work[:, None]]
        if power_alone:
            return power_rows(motion, of_power, line.known, unsure)
        own, known = stack.sparse_by_joint(motion, torque_values), stack.shift_torque(motion, sparse=True)
        return rows_of_both(stack, motion, [*own, of_power], (known, line.known), unsure)

    return equations


def _line(
    stack: Stack, motion: Motion, torque_values: np.ndarray, power_values: np.ndarray
) -> tuple[PowerLine[Columns], np.ndarray]:
    """Return power's line about the coefficients of torque and of power, and the columns of power (N, L) there."""
    torque = stack.real_torque(motion, torque_values, sparse=True)
    drawn = stack.predicted_power_columns(motion, torque_values, power_values, torque)
    carrying = partial(stack.sparse_carried, motion, values=torque_values)
    return power_line(stack, motion, carrying, torque, drawn, power_values), drawn


def _beside(of_torque: Sequence[Block], of_power: Sequence[Block], pattern: np.ndarray) -> list[Block]:
    """Return blocks of the equations of torque, the first of `of_torque`, and last that of power, by stretch of time.

    Where one has no rows, its factor is empty.
    """
    joints = len(pattern) - 1
    nothing = [np.zeros((0, int(row.sum()) + 1)) for row in pattern]
    torque = {(block.run, block.start): block for block in of_torque}
    power = {(block.run, block.start): block for block in of_power}
    blocks = []
    for place, block in sorted({**power, **torque}.items()):
        mine, own = torque.get(place), power.get(place)
        rows = [*(mine.rows[:joints] if mine else [0] * joints), own.rows[0] if own else 0]
        factors = (*(mine.factors if mine else nothing)[:joints], *(own.factors if own else nothing[joints:]))
        if any(rows):
            blocks.append(replace(block, rows=np.array(rows), factors=factors))
    return blocks


def free_terms(stack: Stack) -> Terms:
    """Return the terms of power that are not fixed."""
    return [(effect, term) for effect, term in stack.power_terms if not term.fixed]


def real_terms(stack: Stack) -> Terms:
    """Return the terms of real torque."""
    return [pair for pair, is_real in zip(stack.torque_terms, stack.real, strict=True) if is_real]


def fit_through_power(stack: Stack, motions: Sequence[Motion]) -> tuple[np.ndarray, np.ndarray, list[Block], Estimate]:
    """Fit the coefficients of torque and power together to measured power, which torque carries into it.

    Return the coefficients of torque (K,) and of power (L,), those not free as expected; and equations and estimate of
    `real_terms` and `free_terms`, as `fit_torque` returns them. Losses grow with torque squared, so power is not linear
    in both: Gauss-Newton, from no torque, where the first step is that of a robot without such losses.
    """
    real, free = real_terms(stack), free_terms(stack)
    torque_values, power_values = np.zeros(len(stack.torque_terms)), expected(stack.power_terms)
    terms, before = _of([*real, *free]), np.full(len(real) + len(free), np.inf)

    def equations(motion: Motion) -> Rows:  # about the values as they are then
        line, _ = _line(stack, motion, torque_values, power_values)
        return power_rows(motion, [*line.carried, line.free], line.known)

    for _ in range(_STEPS):
        blocks, fitted = estimate_one(motions, equations, terms, stack.prior_rows([*real, *free]))
        torque_values[stack.real], power_values[~stack.fixed] = np.split(fitted.values, [len(real)])
        if _converged(fitted.values, before, terms):
            break
        before = fitted.values
    return torque_values, power_values, blocks, fitted


def _alone(stack: Stack, motions: Sequence[Motion], known: ReducedTorque | None) -> np.ndarray:
    """Return the coefficients of the effects that need no prediction, fitted without the others, which are none."""
    direct = Stack(stack.robot, [effect for effect in stack.effects if effect.signal == "torque" and not effect.needs])
    values = np.zeros(len(stack.torque_terms))
    if direct.torque_terms:
        values[[not effect.needs for effect, _ in stack.torque_terms]] = fit_torque(direct, motions, known)[1].values
    return values


def _converged(values: np.ndarray, before: np.ndarray, terms: Sequence[Term]) -> bool:
    return bool(np.all(np.abs(values - before) < _CONVERGED * np.array([term.spread for term in terms])))


def _of(terms: Terms) -> list[Term]:
    return [term for _, term in terms]
