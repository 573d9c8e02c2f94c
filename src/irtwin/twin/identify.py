"""Identification: from measured motions to a twin. What was measured decides the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy

from irtwin.document.odd_stretch import OddStretch
from irtwin.effects.catalogue import BASELINE
from irtwin.effects.effect import NORMAL, Coefficients, Effect
from irtwin.effects.prior import Prior
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.identification.accumulate import Block
from irtwin.identification.base_parameters import base_parameters, condition_number
from irtwin.identification.consistent_bodies import spreads, with_consistent_bodies
from irtwin.identification.estimators import Estimate, combine
from irtwin.identification.fits import (
    Terms,
    fit_both,
    fit_power,
    fit_through_power,
    fit_torque,
    free_terms,
    predicted_losses,
    real_terms,
)
from irtwin.identification.friction_near_zero import with_friction_near_zero
from irtwin.identification.remainder import Remainder, of_pauses, of_rest, remainder
from irtwin.identification.robust_weights import odd_stretches
from irtwin.identification.run_scatter import with_run_scatter
from irtwin.identification.torque_constants import torque_from_current
from irtwin.identification.two_processes import one_blas_thread
from irtwin.identification.uncertainty import half_widths, normal_covariance
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion, pauses
from irtwin.twin.shapes import shaped_for_power, shaped_for_torque
from irtwin.twin.twin import BaseParameter, Parameter, Twin

Found = tuple[Terms, Estimate]


@one_blas_thread()
def identify(
    robot: Robot, motions: Sequence[Motion], effects: Sequence[str | Effect] = BASELINE, prior: Prior | None = None
) -> Twin:
    """Return the twin of a robot that fits the motions.

    - Where torque was measured, it gives the coefficients of torque, together with power where that was measured too;
      then power gives those of power, on top of the torque that the twin predicts.
    - Where power and motor currents were measured but no torque, their balance gives the torque constants first, and
      these the torque.
    - Where power alone was measured, the coefficients of torque are found through the power that torque carries.

    Effects are ids, for which the data choose among the candidates of shape (joint by joint), or effects of a shape.
    Those that nothing measured can show are listed as `unidentified`, and left out. Where columns depend on what other
    effects predict, fit and prediction are repeated until they agree. `prior` is what is known before the motions;
    None: what the catalogue expects. Raises InputError where there is nothing to fit.
    """
    if not motions:
        raise InputError("there is no run to fit a twin to; give at least one")
    robot, motions, constants = torque_from_current(robot, motions)
    with_torque = [motion for motion in motions if motion.torque is not None]
    with_power = [motion for motion in motions if motion.power is not None]
    measured = [motion for motion in motions if motion.torque is not None or motion.power is not None]
    if not with_torque and not with_power:
        raise InputError("neither torque nor power was measured in any run; log tau_, i_ or power")
    robot, reduced = with_friction_near_zero(robot, with_torque, effects)
    stack = _visible(Stack(robot, effects, prior), torque=bool(with_torque), power=bool(with_power))
    open_shapes = {effect for effect in effects if isinstance(effect, str)}
    left, predicted = list[Block](), list[Block]()
    base: tuple[BaseParameter, ...] = ()
    condition: float | None = None
    change: float | None = None
    odd: tuple[OddStretch, ...] = ()
    if with_torque:
        found_shapes = shaped_for_torque(stack, open_shapes, with_torque, reduced).effects
        if found_shapes != stack.effects:  # all shapes at once had explained a turn of friction, too
            robot, reduced = with_friction_near_zero(robot, with_torque, found_shapes)
            stack = Stack(robot, found_shapes, prior)
        blocks, torque = fit_torque(stack, with_torque, reduced)
        counting = [block.weighted(own) for block, own in zip(blocks, torque.weights, strict=True)]
        odd = odd_stretches(blocks, torque.weights, robot.joint_names)
        powered = bool(with_power) and not stack.fixed.all()
        if powered:
            values = torque.values
            stack = shaped_for_power(stack, open_shapes, with_power, values)
            if any(effect.carries_torque for effect in stack.effects):
                known = blocks if len(with_torque) == len(measured) else None
                torque = fit_both(stack, measured, values, known)
        free, torque = torque, with_consistent_bodies(stack, stack.torque_terms, torque)
        torque = with_run_scatter(stack, counting, torque)
        fits: list[Found] = [(stack.torque_terms, torque)]
        if powered:
            left, power = fit_power(stack, with_power, torque.values)
            predicted = predicted_losses(stack, with_power, torque.values, power.values)
            fits.append((free_terms(stack), power))
        factors = [combine([block.factors[e] for block in counting], used) for e, used in enumerate(stack.pattern)]
        base, condition = _base(stack, factors, torque)
        change = _change(factors, torque.values - free.values)
    else:
        terms = [*real_terms(stack), *free_terms(stack)]
        left, through = fit_through_power(stack, with_power)[2:]
        predicted = left
        fits = [(terms, with_consistent_bodies(stack, terms, through))]
    remaining = _remainder(stack, left, predicted, fits[-1][0])
    if constants:
        fits.append((constants.terms, constants.estimate))
    parameters = [parameter for terms, result in fits for parameter in _parameters(stack, terms, result, remaining)]
    twin = Twin(
        robot=robot,
        effects=stack.effects,
        parameters=tuple(parameters),
        cutoff=max((motion.cutoff for motion in motions if motion.cutoff), default=None),
        unidentified=tuple(effect for effect in Stack(robot, effects).ids if effect not in stack.ids),
        base_parameters=base,
        condition_number=condition,
        fitted=tuple(dict.fromkeys(motion.run for motion in motions)),
        quantities=_quantities(robot, fits[: len(fits) - bool(constants)], parameters),
        covariance=scipy.linalg.block_diag(*(normal_covariance(fit.covariance, fit.blocks) for _, fit in fits)),
        remainder=remaining,
        body_change=change,
        odd_stretches=odd,
    )
    return _with_pauses(twin, with_power)


def _with_pauses(twin: Twin, motions: Sequence[Motion]) -> Twin:
    """Return the twin with what its effects leave of pauses; what is drawn at rest is no surer than that."""
    if twin.remainder is None:
        return twin
    left = [part.power - twin.power(part) for motion in motions if motion.power is not None for part in pauses(motion)]
    rest = NORMAL * of_rest(left)
    parameters = (
        _widened(parameter, rest) if parameter.effect in twin.at_rest else parameter for parameter in twin.parameters
    )
    return replace(twin, remainder=replace(twin.remainder, pause=of_pauses(left)), parameters=tuple(parameters))


def _widened(parameter: Parameter, half: float) -> Parameter:
    """Return a parameter that is at least 0 and unsure by `half` of an interval more."""
    if parameter.lower is None or parameter.upper is None:
        return parameter
    width = float(np.hypot(parameter.upper - parameter.value, half))
    return replace(parameter, lower=max(parameter.value - width, 0.0), upper=parameter.value + width)


def _remainder(stack: Stack, blocks: Sequence[Block], predicted: Sequence[Block], terms: Terms) -> Remainder | None:
    """Return what the fit of power, of these terms, leaves; None where there is none, or no standby in it."""
    ones = [k for k, (effect, _) in enumerate(terms) if effect.drawn_at_rest]
    if not blocks or not ones:
        return None
    return remainder(blocks, predicted, [term for _, term in terms], stack.prior_rows(terms), ones[0])


def _visible(whole: Stack, *, torque: bool, power: bool) -> Stack:
    """Return the effects that can be told from what was measured, or that hold nothing to be told."""
    seen = {effect.id for effect, term in whole.power_terms if power or term.fixed}
    carried = any(effect.carries_torque for effect in whole.effects)
    seen |= {effect.id for effect, _ in whole.torque_terms if torque or (carried and effect.channel == "torque")}
    return whole.with_effects([effect for effect in whole.effects if effect.id in seen])


def _parameters(stack: Stack, terms: Terms, fit: Estimate, left: Remainder | None) -> list[Parameter]:
    """Return the terms' parameters; what lasts of the remainder looks like what is drawn at rest."""
    lasting = np.array([NORMAL * left.mean if left and effect.drawn_at_rest else 0.0 for effect, _ in terms])
    widths = np.hypot(half_widths(fit.covariance, spreads(stack, terms), fit.blocks), lasting)
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
        for (effect, term), value, width in zip(terms, fit.values, widths, strict=True)
    ]


def _quantities(robot: Robot, fits: Sequence[Found], parameters: Sequence[Parameter]) -> tuple[Parameter, ...]:
    """Return the catalogue's parameters of effects whose coefficients are others."""
    known = {(parameter.effect, parameter.joint, parameter.name): parameter.value for parameter in parameters}
    told = []
    for terms, result in fits:
        for effect in dict.fromkeys(effect for effect, _ in terms):
            if type(effect).parameters is Effect.parameters:
                continue
            own = [place for place, (owner, _) in enumerate(terms) if owner is effect]
            given = Coefficients(result.values[own], result.covariance[np.ix_(own, own)], known)
            for number in effect.parameters(robot, given):
                place = (number.joint, None, number.name, number.value, number.unit, number.lower, number.upper)
                told.append(Parameter(effect.id, *place))
    return tuple(told)


def _base(stack: Stack, factors: Sequence[np.ndarray], fit: Estimate) -> tuple[tuple[BaseParameter, ...], float | None]:
    """Return the base parameters, and the condition number of the equations of torque; None where it is infinite."""
    base = base_parameters(stack)
    condition = condition_number(np.concatenate(factors)[:, :-1], base)
    values, covariance = base.grouping @ fit.values, base.grouping @ fit.covariance @ base.grouping.T
    widths = half_widths(covariance, np.full(len(values), np.inf), fit.blocks)
    told = tuple(
        BaseParameter(name, float(value), base.terms[k].unit, float(value - width), float(value + width))
        for name, k, value, width in zip(base.names(), base.independent, values, widths, strict=True)
    )
    return told, condition if np.isfinite(condition) else None


def _change(factors: Sequence[np.ndarray], moved: np.ndarray) -> float:
    """Return what coefficients that `moved` (K,) change of a joint's torque, as a share of it (RMS); the greatest."""
    sizes = (float(np.linalg.norm(factor[:, -1])) for factor in factors)
    changes = (float(np.linalg.norm(factor[:, :-1] @ moved)) for factor in factors)
    return max((change / size for change, size in zip(changes, sizes, strict=True) if size), default=0.0)
