"""Identification: from measured motions to a twin. What was measured decides the way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.effect import Effect, JointEffect, Term
from irtwin.effects.prior import Prior
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.identification.accumulate import Block, Equations, Rows, accumulate
from irtwin.identification.base_parameters import BaseParameters, base_parameters, condition_number
from irtwin.identification.estimators import Estimate, combine, estimate
from irtwin.identification.threads import one_blas_thread
from irtwin.identification.torque_constants import TorqueConstants, torque_constants
from irtwin.identification.uncertainty import half_widths, normal_covariance
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion
from irtwin.twin.twin import BaseParameter, Parameter, Twin

Terms = Sequence[tuple[Effect, Term]]
Found = tuple[Terms, Estimate]

_STEPS = 20  # of Gauss-Newton, at most
_CONVERGED = 1e-3  # of the prior spread
_REPEATS = 8  # of fit and prediction, at most
_TORQUE_STEP = 1e-2  # N m, exact for what is quadratic in torque


@one_blas_thread()
def identify(
    robot: Robot,
    motions: Sequence[Motion],
    effects: Sequence[str | Effect] = BASELINE,
    prior: Prior | None = None,
) -> Twin:
    """Return the twin of a robot that fits the motions.

    - Where torque was measured, it gives the coefficients of torque; then power, where it was measured, gives those
      of power, on top of the torque that the twin predicts.
    - Where power and motor currents were measured but no torque, their balance gives the torque constants first, and
      these the torque.
    - Where power alone was measured, the coefficients of torque are found through the power that torque carries.

    Effects are ids, for which the data choose among the candidates of shape (joint by joint), or effects of a shape.
    Those that nothing measured can show are
    listed as `unidentified`, and left out. Where columns depend on what other effects predict, fit and prediction are
    repeated until they agree. `prior` is what is known before the motions; None: what the catalogue expects. Raises
    InputError where there is nothing to fit.
    """
    if not motions:
        raise InputError("there is no run to fit a twin to; give at least one")
    constants = None
    if not any(motion.torque is not None for motion in motions):
        robot, motions, constants = _torque_from_current(robot, motions)
    with_torque = [motion for motion in motions if motion.torque is not None]
    with_power = [motion for motion in motions if motion.power is not None]
    if not with_torque and not with_power:
        raise InputError("neither torque nor power was measured in any run; log tau_, i_ or power")
    stack = _visible(Stack(robot, effects, prior), torque=bool(with_torque), power=bool(with_power))
    open_shapes = {effect for effect in effects if isinstance(effect, str)}
    fit = None
    if with_torque:
        stack = _shaped(stack, open_shapes, "torque", lambda trial: _solve_torque(trial, with_torque)[1])
        fit = _fit_torque(stack, with_torque)
        torque_values = fit.estimate.values
        found: list[Found] = [(stack.torque_terms, fit.estimate)]
        if with_power and not stack.fixed.all():
            stack = _shaped(stack, open_shapes, "power", lambda trial: _fit_power(trial, with_power, torque_values)[1])
            found.append(_fit_power(stack, with_power, torque_values))
    else:
        found = _found_through_power(stack, with_power)
    if constants:
        found.append((constants.terms, constants.estimate))
    parameters = [parameter for terms, result in found for parameter in _parameters(terms, result)]
    return Twin(
        robot=robot,
        effects=stack.effects,
        parameters=tuple(parameters),
        cutoff=max((motion.cutoff for motion in motions if motion.cutoff), default=None),
        unidentified=tuple(effect for effect in Stack(robot, effects).ids if effect not in stack.ids),
        base_parameters=fit.base if fit else (),
        condition_number=fit.condition if fit and np.isfinite(fit.condition) else None,
        fitted=tuple(dict.fromkeys(motion.run for motion in motions)),
        quantities=_quantities(robot, found[: len(found) - bool(constants)], parameters),
        covariance=block_diag(*(normal_covariance(result.covariance, result.blocks) for _, result in found)),
    )


@dataclass(frozen=True)
class _TorqueFit:
    estimate: Estimate
    base: tuple[BaseParameter, ...]
    condition: float


def _visible(whole: Stack, *, torque: bool, power: bool) -> Stack:
    """Return the effects that can be told from what was measured, or that hold nothing to be told."""
    seen = {effect.id for effect, term in whole.power_terms if power or term.fixed}
    carried = any(effect.carries_torque for effect in whole.effects)
    seen |= {effect.id for effect, _ in whole.torque_terms if torque or (carried and effect.channel == "torque")}
    return whole.with_effects([effect for effect in whole.effects if effect.id in seen])


def _torque_from_current(robot: Robot, motions: Sequence[Motion]) -> tuple[Robot, list[Motion], TorqueConstants | None]:
    """Give motions their torque, current times torque constant, where the power balance tells the constants."""
    telling = [motion for motion in motions if motion.current is not None and motion.power is not None]
    if not telling:
        return robot, list(motions), None
    found = torque_constants(robot, telling)
    joints = tuple(
        replace(joint, torque_constant=float(constant))
        for joint, constant in zip(robot.joints, found.constants, strict=True)
    )
    known = [
        motion if motion.current is None else replace(motion, torque=motion.current * found.constants)
        for motion in motions
    ]
    return replace(robot, joints=joints), known, found


def _shaped(stack: Stack, open_shapes: set[str], signal: str, fit: Callable[[Stack], Estimate]) -> Stack:
    """Give each effect of the signal, whose shape is open, the one that leaves least of what was measured."""
    effects = list(stack.effects)
    for effect in stack.effects:
        shapes = effect.candidates(stack.robot)
        if effect.id not in open_shapes or effect.signal != signal or len(shapes) < 2:
            continue
        place = effects.index(effect)
        before, after = effects[:place], effects[place + 1 :]
        noise = np.array([fit(stack.with_effects([*before, shape, *after])).noise for shape in shapes])
        effects = [*before, *_best(shapes, noise, stack.robot), *after]
    return stack.with_effects(effects)


def _best(shapes: Sequence[Effect], noise: np.ndarray, robot: Robot) -> list[Effect]:
    """Return the best of shapes by what each leaves in g equations, (shapes, g): joint by joint where it acts so."""
    if not isinstance(shapes[0], JointEffect) or noise.shape[1] != len(robot.joints):
        return [shapes[int(np.argmin(np.log(noise).sum(axis=1)))]]
    chosen: dict[int, list[str]] = {}
    for joint, best in zip(robot.joint_names, np.argmin(noise, axis=0).tolist(), strict=True):
        chosen.setdefault(best, []).append(joint)
    if len(chosen) == 1:
        return [shapes[next(iter(chosen))]]
    return [shapes[best].on(*joints) for best, joints in chosen.items()]


def _fit_torque(stack: Stack, motions: Sequence[Motion]) -> _TorqueFit:
    blocks, found = _solve_torque(stack, motions)
    base = base_parameters(stack)
    factors = [combine([block.factors[e] for block in blocks], used) for e, used in enumerate(stack.pattern)]
    return _TorqueFit(found, _base(base, found), condition_number(np.concatenate(factors)[:, :-1], base))


def _solve_torque(stack: Stack, motions: Sequence[Motion]) -> tuple[list[Block], Estimate]:
    terms, known = [term for _, term in stack.torque_terms], stack.prior_rows(stack.torque_terms)

    def fit(values: np.ndarray | None) -> tuple[list[Block], Estimate]:
        blocks = accumulate(motions, _torque_equations(stack, values), stack.pattern)
        return blocks, estimate(blocks, stack.pattern, terms, known)

    blocks, found = fit(_alone(stack, motions) if stack.coupled else None)
    for _ in range(_REPEATS if stack.coupled else 0):
        before = found.values
        blocks, found = fit(before)
        if _settled(found.values, before, terms):
            break
    return blocks, found


def _torque_equations(stack: Stack, values: np.ndarray | None) -> Equations:
    def equations(motion: Motion) -> Rows:
        assert motion.torque is not None
        columns = stack.columns_by_joint(motion, values)
        shifted = stack.shift_torque(motion, columns)
        return Rows([[own] for own in columns], shifted, motion.torque, stack.undecided(motion))

    return equations


def _alone(stack: Stack, motions: Sequence[Motion]) -> np.ndarray:
    """Return the coefficients of the effects that need no prediction, fitted without the others, which are none."""
    direct = Stack(stack.robot, [effect for effect in stack.effects if effect.signal == "torque" and not effect.needs])
    values = np.zeros(len(stack.torque_terms))
    if direct.torque_terms:
        blocks = accumulate(motions, _torque_equations(direct, None), direct.pattern)
        found = estimate(blocks, direct.pattern, [term for _, term in direct.torque_terms])
        values[[not effect.needs for effect, _ in stack.torque_terms]] = found.values
    return values


def _settled(values: np.ndarray, before: np.ndarray, terms: Sequence[Term]) -> bool:
    return bool(np.all(np.abs(values - before) < _CONVERGED * np.array([term.spread for term in terms])))


def _fit_power(stack: Stack, motions: Sequence[Motion], torque_values: np.ndarray) -> Found:
    """Fit the coefficients of power on top of the torque that was found."""
    free = [(effect, term) for effect, term in stack.power_terms if not term.fixed]

    def fit(values: np.ndarray) -> Estimate:
        def equations(motion: Motion) -> Rows:
            assert motion.power is not None
            columns = stack.predicted_power_columns(motion, torque_values, values)
            known = columns[:, stack.fixed] @ _expected(stack.power_terms)[stack.fixed]
            return Rows(columns[:, None, ~stack.fixed], known[:, None], motion.power[:, None])

        return _estimate(motions, equations, free, stack.prior_rows(free))

    values = _expected(stack.power_terms)
    found = fit(values)
    for _ in range(_REPEATS if stack.power_coupled else 0):
        before = found.values
        values = values.copy()
        values[~stack.fixed] = before
        found = fit(values)
        if _settled(found.values, before, [term for _, term in free]):
            break
    return free, found


def fit_through_power(stack: Stack, motions: Sequence[Motion]) -> tuple[np.ndarray, np.ndarray]:
    """Return the coefficients of torque (K,) and of power (L,) that fit measured power; those not free as expected."""
    torque_values, power_values, _ = _solve_through_power(stack, motions)
    return torque_values, power_values


def _found_through_power(stack: Stack, motions: Sequence[Motion]) -> list[Found]:
    torque_terms, free = _open_terms(stack)
    return [([*torque_terms, *free], _solve_through_power(stack, motions)[2])]


def _open_terms(stack: Stack) -> tuple[Terms, Terms]:
    """Return the terms of real torque, and those of power that are not fixed."""
    real = [pair for pair, is_real in zip(stack.torque_terms, stack.real, strict=True) if is_real]
    return real, [(effect, term) for effect, term in stack.power_terms if not term.fixed]


def _solve_through_power(stack: Stack, motions: Sequence[Motion]) -> tuple[np.ndarray, np.ndarray, Estimate]:
    """Fit the coefficients of torque and power together to measured power, which torque carries into it.

    Losses grow with torque squared, so power is not linear in both: Gauss-Newton, from no torque, where the first
    step is that of a robot without such losses.
    """
    real, free = _open_terms(stack)
    torque_values, power_values = np.zeros(len(stack.torque_terms)), _expected(stack.power_terms)
    spread = np.array([term.spread for _, term in (*real, *free)])
    before = np.full(len(spread), np.inf)
    for _ in range(_STEPS):
        equations = _linearised(stack, torque_values.copy(), power_values.copy())
        found = _estimate(motions, equations, [*real, *free], stack.prior_rows([*real, *free]))
        torque_values[stack.real], power_values[~stack.fixed] = np.split(found.values, [len(real)])
        if np.all(np.abs(found.values - before) < _CONVERGED * spread):
            break
        before = found.values
    return torque_values, power_values, found


def _linearised(stack: Stack, torque_values: np.ndarray, power_values: np.ndarray) -> Equations:
    """Return the equation of power, linear in the deviation of the torque coefficients from `torque_values`.

    Effects that need predicted power take it as it is with these values.
    """

    def equations(motion: Motion) -> Rows:
        assert motion.power is not None
        columns = stack.torque_columns(motion, torque_values)[:, :, stack.real]
        torque = stack.real_torque(motion, torque_values)
        power = stack.predicted_power_columns(motion, torque_values, power_values)
        carried = np.einsum("tj,tjk->tk", power_slope(stack, motion, torque, power_values), columns)
        known = power[:, stack.fixed] @ power_values[stack.fixed] - carried @ torque_values[stack.real]
        columns = np.concatenate([carried, power[:, ~stack.fixed]], axis=1)
        return Rows(columns[:, None], known[:, None], motion.power[:, None])

    return equations


def power_slope(stack: Stack, motion: Motion, torque: np.ndarray, power_values: np.ndarray) -> np.ndarray:
    """Return the slope of power over each joint's torque, (N, n) W/(N m), about `torque` (N, n)."""
    slope = np.empty_like(torque)
    for joint in range(torque.shape[1]):
        step = np.zeros(torque.shape[1])
        step[joint] = _TORQUE_STEP
        rise = stack.power_columns(motion, torque + step) - stack.power_columns(motion, torque - step)
        slope[:, joint] = rise @ power_values / (2 * _TORQUE_STEP)
    return slope


def _estimate(motions: Sequence[Motion], equations: Equations, terms: Terms, prior_rows: np.ndarray | None) -> Estimate:
    """Estimate the terms of one equation a sample."""
    pattern = np.ones((1, len(terms)), dtype=bool)
    return estimate(accumulate(motions, equations, pattern), pattern, [term for _, term in terms], prior_rows)


def _expected(terms: Terms) -> np.ndarray:
    return np.array([term.expected for _, term in terms], dtype=float)


def _parameters(terms: Terms, found: Estimate) -> list[Parameter]:
    spread = np.array([term.spread for _, term in terms])
    widths = half_widths(found.covariance, spread, found.blocks)
    return [
        Parameter(
            effect=effect.id,
            joint=term.joint,
            link=term.link,
            name=term.name,
            value=float(value),
            unit=term.unit,
            lower=None if np.isnan(width) else float(max(value - width, term.lowest)),
            upper=None if np.isnan(width) else float(value + width),
        )
        for (effect, term), value, width in zip(terms, found.values, widths, strict=True)
    ]


def _quantities(robot: Robot, found: Sequence[Found], parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Return the catalogue's parameters of effects whose coefficients are others."""
    known = {(parameter.effect, parameter.joint, parameter.name): parameter.value for parameter in parameters}
    told = []
    for terms, result in found:
        for effect in dict.fromkeys(effect for effect, _ in terms):
            if type(effect).parameters is Effect.parameters:
                continue
            own = [place for place, (owner, _) in enumerate(terms) if owner is effect]
            values, covariance = result.values[own], result.covariance[np.ix_(own, own)]
            for each in effect.parameters(robot, values, covariance, known):
                place = (each.joint, None, each.name, each.value, each.unit, each.lower, each.upper)
                told.append(Parameter(effect.id, *place))
    return tuple(told)


def _base(base: BaseParameters, found: Estimate) -> tuple[BaseParameter, ...]:
    values = base.grouping @ found.values
    covariance = base.grouping @ found.covariance @ base.grouping.T
    widths = half_widths(covariance, np.full(len(values), np.inf), found.blocks)
    units = [base.terms[k].unit for k in base.independent]
    return tuple(
        BaseParameter(name, float(value), unit, float(value - width), float(value + width))
        for name, value, unit, width in zip(base.names(), values, units, widths, strict=True)
    )
