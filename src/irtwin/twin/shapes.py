"""The shapes of a twin's effects that are named by id alone: those that leave least of what was measured."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import dataclass, replace

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
_PASSES = 3  # over the numbers of a shape, of all joints at once: each stands on the others', and is looked at closer
_SWEEPS = 4  # over effects that share a joint, at most: the shape of one stands on the other's


Left = Callable[[Sequence[Stack]], list[np.ndarray]]
"""What each of some stacks leaves of each equation, (g,) RMS."""


@dataclass(frozen=True)
class _Side:
    """Motions with torque, of a robot whose friction near zero speed is theirs; `reduced`: equations of torque."""

    robot: Robot
    reduced: ReducedTorque | None
    motions: Sequence[Motion]

    @property
    def powered(self) -> list[Motion]:
        return [motion for motion in self.motions if motion.power is not None]

    def torque(self, trials: Sequence[Stack]) -> list[Estimate]:
        return _of_torque([Stack(self.robot, trial.effects) for trial in trials], self.motions, self.reduced)

    def power(self, trial: Stack, torque_values: np.ndarray) -> Estimate:
        return _of_power(Stack(self.robot, trial.effects), self.powered, torque_values)


def shaped(
    robot: Robot, sides: Sequence[Sequence[Motion]], effects: Sequence[str | Effect]
) -> tuple[str | Effect, ...]:
    """Return effects of open shape, those given by id, in the shapes that motions show, and all others as they are.

    One may then be several, each at some joints. `sides` are motions of which each has coefficients of its own, as of a
    robot in which something changed; they share the shapes. Motions without torque tell nothing.
    """
    with_torque = [own for side in sides if (own := [motion for motion in side if motion.torque is not None])]
    powered = any(motion.power is not None for own in with_torque for motion in own)
    named, stack = {effect for effect in effects if isinstance(effect, str)}, Stack(robot, effects)
    of_torque, of_power = (
        {effect.id for effect in stack.effects if effect.id in named and _has_open_shape(effect, signal, robot)}
        for signal in ("torque", "power")
    )
    tried = (of_torque if with_torque else set()) | (of_power if powered else set())
    if not tried:
        return tuple(effects)
    parts = [_Side(*with_friction_near_zero(robot, own, effects), own) for own in with_torque]
    stack = Stack(parts[0].robot, effects)

    def left_of_torque(trials: Sequence[Stack]) -> list[np.ndarray]:
        return [_together(parts, fits) for fits in zip(*(part.torque(trials) for part in parts), strict=True)]

    stack = _shaped(stack, tried, "torque", left_of_torque)
    if tried & of_power:
        metered = [part for part in parts if part.powered]
        values = [part.torque([stack])[0].values for part in metered]

        def left_of_power(trials: Sequence[Stack]) -> list[np.ndarray]:
            pairs = list(zip(metered, values, strict=True))
            return [_together(metered, [part.power(trial, own) for part, own in pairs]) for trial in trials]

        stack = _shaped(stack, tried, "power", left_of_power)
    return (
        *(effect for effect in effects if effect not in tried),
        *(effect for effect in stack.effects if effect.id in tried),
    )


def _together(parts: Sequence[_Side], fits: Sequence[Estimate]) -> np.ndarray:
    """Return (g,) RMS of what is left in all parts."""
    samples = [sum(len(motion.time) for motion in part.motions) for part in parts]
    return np.asarray(np.sqrt(np.average([fit.noise**2 for fit in fits], axis=0, weights=samples)))


def shaped_for_torque(
    stack: Stack, open_shapes: Set[str], motions: Sequence[Motion], reduced: ReducedTorque | None
) -> Stack:
    """Return a stack with the effects of torque, whose shape is open, in that which leaves least of measured torque."""

    def left(trials: Sequence[Stack]) -> list[np.ndarray]:
        return [fit.noise for fit in _of_torque(trials, motions, reduced)]

    return _shaped(stack, open_shapes, "torque", left)


def shaped_for_power(
    stack: Stack, open_shapes: Set[str], motions: Sequence[Motion], torque_values: np.ndarray
) -> Stack:
    """Return the same of power, on top of torque by coefficients that were found; a part of a long log is read."""

    def left(trials: Sequence[Stack]) -> list[np.ndarray]:
        return [_of_power(trial, motions, torque_values).noise for trial in trials]

    return _shaped(stack, open_shapes, "power", left)


def _of_torque(trials: Sequence[Stack], motions: Sequence[Motion], reduced: ReducedTorque | None) -> list[Estimate]:
    known = reduced is not None and all(map(reduced.has, trials))
    if len(trials) > 1 and not known and not any(trial.coupled for trial in trials):  # samples are read once for all
        reduced = ReducedTorque.of_all(trials, motions)
    return [fit_torque(trial, motions, reduced)[1] for trial in trials]


def _of_power(trial: Stack, motions: Sequence[Motion], torque_values: np.ndarray) -> Estimate:
    return fit_power(trial, motions, torque_values, part_read(motions), switching=True)[1]


def _has_open_shape(effect: Effect, signal: str, robot: Robot) -> bool:
    return effect.signal == signal and len(effect.candidates(robot)) > 1


def _shaped(stack: Stack, open_shapes: Set[str], signal: str, left: Left) -> Stack:
    """Give each effect of the signal, whose shape is open, the one that leaves least beside the others' shapes."""
    opened = [
        effect for effect in stack.effects if effect.id in open_shapes and _has_open_shape(effect, signal, stack.robot)
    ]
    for _ in range(_SWEEPS if len(opened) > 1 else 1):
        before = stack.effects
        for effect in opened:
            stack = _with_best_shape(stack, effect, left)
        if stack.effects == before:
            break
    for effect in opened:
        stack = _with_shape_between(stack, effect, left)
    return stack


def _with_best_shape(stack: Stack, effect: Effect, left: Left) -> Stack:
    """Give an effect the best of the shapes that are tried: joint by joint where it acts so."""
    before, _, after = _around(stack, effect.id)
    shapes = effect.candidates(stack.robot)
    noise = np.array(left([stack.with_effects([*before, shape, *after]) for shape in shapes]))
    if not (isinstance(effect, JointEffect) and effect.signal == "torque"):
        return stack.with_effects([*before, shapes[int(np.argmin(np.log(noise).sum(axis=1)))], *after])
    places = {joint.name: stack.robot.index(joint.name) for joint in effect.acting(stack.robot)}
    best = {joint: shapes[int(np.argmin(noise[:, place]))] for joint, place in places.items()}
    return stack.with_effects([*before, *_by_shape(best, stack.robot), *after])


def _with_shape_between(stack: Stack, effect: Effect, left: Left) -> Stack:
    """Give an effect the shape between those that were tried that leaves least."""
    before, own, after = _around(stack, effect.id)
    shapes = effect.candidates(stack.robot)

    def left_by(trials: Sequence[Sequence[Effect]]) -> list[np.ndarray]:
        return left([stack.with_effects([*before, *some, *after]) for some in trials])

    if not isinstance(effect, JointEffect):
        best = _between(own[0], shapes, lambda shape: float(np.log(left_by([[shape]])[0]).sum()))
        return stack.with_effects([*before, best, *after])
    if effect.signal == "torque":
        of_joint = {joint.name: replace(shape, joints=None) for shape in own for joint in shape.acting(stack.robot)}
        of_joint = _between_by_joint(of_joint, shapes, stack.robot, left_by)
        return stack.with_effects([*before, *_by_shape(of_joint, stack.robot), *after])
    return stack


def _around(stack: Stack, effect: str) -> tuple[Sequence[Effect], Sequence[Effect], Sequence[Effect]]:
    """Return what stands before an effect, the effect, which may be several, and what stands after."""
    first = [stacked.id for stacked in stack.effects].index(effect)
    own, after = (
        [stacked for stacked in stack.effects[first:] if (stacked.id == effect) is of_it] for of_it in (True, False)
    )
    return stack.effects[:first], own, after


def _between(best: Effect, shapes: Sequence[Effect], left: Callable[[Effect], float]) -> Effect:
    """Return the shape that leaves least between the best of those tried and its neighbours, number by number."""
    for name in best.ranges:
        tried = sorted({float(shape.shape[name]) for shape in shapes})
        at = tried.index(best.shape[name])
        ends = tried[max(at - 1, 0)], tried[min(at + 1, len(tried) - 1)]

        def of_number(value: float, best: Effect = best, name: str = name) -> float:
            return left(best.variants(**{name: (float(value),)})[0])

        optimum = scipy.optimize.minimize_scalar(of_number, bounds=ends, method="bounded", options={"maxiter": _LOOKS})
        if optimum.fun < left(best):
            (best,) = best.variants(**{name: (float(optimum.x),)})
    return best


def _between_by_joint(
    best: Mapping[str, Effect],
    shapes: Sequence[Effect],
    robot: Robot,
    left: Callable[[Sequence[Sequence[Effect]]], list[np.ndarray]],
) -> dict[str, Effect]:
    """Return the same joint by joint: all joints are looked at together, first half-way to the neighbours tried."""
    by_joint, places = dict(best), [robot.index(joint) for joint in best]
    tried = {
        name: sorted({*(float(shape.shape[name]) for shape in shapes), *ends})
        for name, ends in shapes[0].ranges.items()
    }
    near = {
        name: [_neighbours(float(shape.shape[name]), some) for shape in best.values()] for name, some in tried.items()
    }
    for last in (False,) * (_PASSES - 1) + (True,):
        for name, ends in near.items():
            own = [float(shape.shape[name]) for shape in by_joint.values()]
            points = np.array([_halved(value, *pair) for value, pair in zip(own, ends, strict=True)])  # (J, 5)
            trials = [_by_shape(_numbered(by_joint, name, values), robot) for values in points.T]
            noise = np.array(left(trials))[:, places].T
            at = np.argmin(noise, axis=1)
            near[name] = [_closer(*pair, tried[name]) for pair in zip(points, at, strict=True)]
            least = [_vertex(*some) if last else some[0][some[2]] for some in zip(points, noise, at, strict=True)]
            by_joint = _numbered(by_joint, name, least)
    return by_joint


def _numbered(by_joint: Mapping[str, Effect], name: str, values: Iterable[float]) -> dict[str, Effect]:
    """Return the shapes with other values of one of their numbers."""
    pairs = zip(by_joint.items(), values, strict=True)
    return {joint: shape.variants(**{name: (float(value),)})[0] for (joint, shape), value in pairs}


def _neighbours(value: float, tried: Sequence[float]) -> tuple[float, float]:
    """Return what was tried next below and above a value, or the value where there is none."""
    below, above = ([other for other in tried if sign * (other - value) > 0] for sign in (-1, 1))
    return max(below, default=value), min(above, default=value)


def _halved(value: float, below: float, above: float) -> list[float]:
    """Return five numbers from `below` to `above`, about the value."""
    return [below, (below + value) / 2, value, (value + above) / 2, above]


def _closer(points: np.ndarray, at: int, tried: Sequence[float]) -> tuple[float, float]:
    """Return what is next below and above the best of five; beyond an end as far as on this side of it."""
    gaps, value = np.diff(points), points[at]
    below, above = value - gaps[max(at - 1, 0)], value + gaps[min(at, len(gaps) - 1)]
    return float(max(below, tried[0])), float(min(above, tried[-1]))


def _vertex(points: np.ndarray, noise: np.ndarray, at: int) -> float:
    """Return where the parabola through the least `noise` and its neighbours is least, or that point."""
    some = slice(at - 1, at + 2)
    if at in (0, len(points) - 1) or len(set(points[some])) < 3:
        return float(points[at])
    bend, slope, _ = np.polyfit(points[some] - points[at], noise[some], 2)
    return float(points[at] - (slope / (2 * bend) if bend > 0 else 0.0))


def _by_shape(of_joint: Mapping[str, Effect], robot: Robot) -> list[Effect]:
    """Return effects, each at the joints that have its shape."""
    joints: dict[Effect, list[str]] = {}
    for joint, effect in of_joint.items():
        joints.setdefault(effect, []).append(joint)
    return [effect if len(some) == len(robot.joints) else effect.on(*some) for effect, some in joints.items()]
