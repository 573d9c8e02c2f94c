"""The shapes of a twin's effects that are named by id alone: those that leave least of what was measured."""

from __future__ import annotations

from collections.abc import Callable, Sequence, Set

import numpy as np
import scipy

from irtwin.effects.effect import Effect, JointEffect
from irtwin.effects.stack import Stack
from irtwin.identification.accumulate import part_read
from irtwin.identification.estimators import Estimate
from irtwin.identification.fits import fit_power, fit_torque
from irtwin.identification.friction_near_zero import with_friction_near_zero
from irtwin.identification.reduced_torque import ReducedTorque
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

_LOOKS = 8  # at shapes between two that were tried
_SWEEPS = 4  # over effects that share a joint, at most: the shape of one stands on the other's


def shaped(robot: Robot, motions: Sequence[Motion], effects: Sequence[str | Effect]) -> tuple[str | Effect, ...]:
    """Return effects of open shape, those given by id, in the shapes that motions show, and all others as they are.

    One may then be several, each at some joints. Motions without torque tell nothing.
    """
    with_torque = [motion for motion in motions if motion.torque is not None]
    with_power = [motion for motion in with_torque if motion.power is not None]
    named, stack = {effect for effect in effects if isinstance(effect, str)}, Stack(robot, effects)
    of_torque, of_power = (
        {one.id for one in stack.effects if one.id in named and _has_open_shape(one, signal, robot)}
        for signal in ("torque", "power")
    )
    tried = (of_torque if with_torque else set()) | (of_power if with_power else set())
    if not tried:
        return tuple(effects)
    turned, reduced = with_friction_near_zero(robot, with_torque, effects)
    stack = shaped_for_torque(Stack(turned, effects), tried, with_torque, reduced)
    if tried & of_power:
        stack = shaped_for_power(stack, tried, with_power, fit_torque(stack, with_torque, reduced)[1].values)
    return (*(one for one in effects if one not in tried), *(one for one in stack.effects if one.id in tried))


def shaped_for_torque(
    stack: Stack, open_shapes: Set[str], motions: Sequence[Motion], reduced: ReducedTorque | None
) -> Stack:
    """Return a stack with the effects of torque, whose shape is open, in that which leaves least of measured torque."""
    return _shaped(stack, open_shapes, "torque", lambda trial: fit_torque(trial, motions, reduced)[1])


def shaped_for_power(
    stack: Stack, open_shapes: Set[str], motions: Sequence[Motion], torque_values: np.ndarray
) -> Stack:
    """Return the same of power, on top of torque by coefficients that were found; a part of a long log is read."""
    every = part_read(motions)
    return _shaped(
        stack, open_shapes, "power", lambda trial: fit_power(trial, motions, torque_values, every, switching=True)[1]
    )


def _has_open_shape(effect: Effect, signal: str, robot: Robot) -> bool:
    return effect.signal == signal and len(effect.candidates(robot)) > 1


def _shaped(stack: Stack, open_shapes: Set[str], signal: str, fit: Callable[[Stack], Estimate]) -> Stack:
    """Give each effect of the signal, whose shape is open, the one that leaves least beside the others' shapes."""
    opened = [one for one in stack.effects if one.id in open_shapes and _has_open_shape(one, signal, stack.robot)]
    for _ in range(_SWEEPS if len(opened) > 1 else 1):
        before = stack.effects
        for effect in opened:
            stack = _with_best_shape(stack, effect, fit)
        if stack.effects == before:
            break
    return stack


def _with_best_shape(stack: Stack, effect: Effect, fit: Callable[[Stack], Estimate]) -> Stack:
    own = [place for place, one in enumerate(stack.effects) if one.id == effect.id]
    before, after = stack.effects[: own[0]], stack.effects[own[-1] + 1 :]
    shapes = effect.candidates(stack.robot)

    def left(shape: Effect) -> np.ndarray:
        return fit(stack.with_effects([*before, shape, *after])).noise

    best = _best(shapes, np.array([left(shape) for shape in shapes]), stack.robot)
    if not isinstance(effect, JointEffect):
        best = [_between(best[0], shapes, lambda shape: float(np.log(left(shape)).sum()))]
    return stack.with_effects([*before, *best, *after])


def _between(best: Effect, shapes: Sequence[Effect], left: Callable[[Effect], float]) -> Effect:
    """Return the shape that leaves least between the best of those tried and its neighbours, number by number."""
    for name in best.ranges:
        tried = sorted({float(shape.shape[name]) for shape in shapes})
        at = tried.index(best.shape[name])
        ends = tried[max(at - 1, 0)], tried[min(at + 1, len(tried) - 1)]

        def of_number(value: float, best: Effect = best, name: str = name) -> float:
            return left(best.variants(**{name: (float(value),)})[0])

        found = scipy.optimize.minimize_scalar(of_number, bounds=ends, method="bounded", options={"maxiter": _LOOKS})
        if found.fun < left(best):
            (best,) = best.variants(**{name: (float(found.x),)})
    return best


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
