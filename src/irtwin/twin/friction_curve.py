"""Friction of each joint as one curve, torque against speed: as a twin has it, and as it was measured."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.document.curves import FrictionCurve, FrictionNumber, MeasuredFriction
from irtwin.effects.effect import NORMAL, Effect, Predicted, force_unit
from irtwin.effects.stack import Stack
from irtwin.signals.conditioning import STANDSTILL
from irtwin.signals.filter import low_pass
from irtwin.signals.motion import Motion
from irtwin.twin.twin import Twin

Numbers = tuple[float, ...]

_STEPS = 30  # speeds either way
_BINS = 10  # of what was measured, either way
_FEWEST = 20  # samples in a bin
_STATES = 60  # poses, temperatures and loads over which a law that depends on them is averaged
_RARE = 0.002  # of all samples are faster than the curve shows
_MOVED = 10 * STANDSTILL  # rad/s or m/s: a joint that was never faster shows no curve


def friction_curves(twin: Twin, motions: Sequence[Motion], role: str) -> tuple[FrictionCurve, ...]:
    """Return the friction of each joint whose numbers the twin knows, over the speeds of the motions, of a role.

    It is the sum of the twin's friction effects. Where these depend on angle, temperature or load, it is their mean
    over the motions; what depends on the way that the joint came is left out.
    """
    laws = sorted(
        (effect for effect in twin.standing if effect.family == "friction" and not effect.memory), key=lambda e: e.stage
    )
    if twin.covariance is None or not laws:
        return ()
    speeds = np.concatenate([motion.dq for motion in motions])
    slowest, fastest = np.quantile(speeds, (_RARE, 1 - _RARE), axis=0)
    grid = _signed(_STEPS, 3, slowest, fastest)
    columns = _columns(twin, laws, motions, grid)
    terms = [(effect.id, term.joint, term.link, term.name) for effect in laws for term in effect.terms(twin.robot)]
    place = {
        (parameter.effect, parameter.joint, parameter.link, parameter.name): k
        for k, parameter in enumerate(twin.parameters)
    }
    own = [place[term] for term in terms]
    torque = columns @ np.array([twin.parameters[k].value for k in own])
    width = NORMAL * np.sqrt(np.einsum("gjk,kl,gjl->gj", columns, twin.covariance[np.ix_(own, own)], columns).clip(0))
    residual = np.concatenate([_residual(twin, motion) for motion in motions])
    curves = []
    for k, joint in enumerate(twin.robot.joints):
        numbers = _numbers(twin, {effect.id for effect in laws}, joint.name)
        if not numbers or fastest[k] - slowest[k] < _MOVED:
            continue
        shown = residual[:, k] + np.interp(speeds[:, k], grid[:, k], torque[:, k])
        curve = FrictionCurve(
            joint=joint.name,
            role=role,
            speed_unit=f"{joint.unit}/s",
            unit=force_unit(joint),
            speed=_listed(grid[:, k]),
            torque=_listed(torque[:, k]),
            low=_listed(torque[:, k] - width[:, k]),
            high=_listed(torque[:, k] + width[:, k]),
            numbers=numbers,
            measured=_binned(speeds[:, k], shown, _signed(_BINS, 2, slowest[k], fastest[k])),
        )
        curves.append(curve)
    return tuple(curves)


def _signed(steps: int, power: int, slowest: np.ndarray, fastest: np.ndarray) -> np.ndarray:
    """Return (2 steps + 1, ...) speeds between two, closest about zero, where friction turns."""
    way = np.linspace(0, 1, steps + 1) ** power
    back, forth = np.multiply.outer(way[:0:-1], np.minimum(slowest, 0)), np.multiply.outer(way, np.maximum(fastest, 0))
    return np.concatenate([back, forth])


def _columns(twin: Twin, laws: Sequence[Effect], motions: Sequence[Motion], grid: np.ndarray) -> np.ndarray:
    """Return the columns (G, n, k) of effects, by stage, at speeds (G, n): their mean over what the motions met."""
    total = sum(len(motion.time) for motion in motions)
    counts = [max(1, round(_STATES * len(motion.time) / total)) for motion in motions]
    states = [m.rows(np.linspace(0, len(m.time) - 1, c).astype(int)) for m, c in zip(motions, counts, strict=True)]
    known = [state.temperature for state in states if state.temperature is not None]
    every, shape = len(grid), (sum(counts), len(twin.robot.joints))
    probe = Motion(
        np.arange(float(every * shape[0])),
        np.tile(np.concatenate([state.q for state in states]), (every, 1)),
        dq=np.repeat(grid, shape[0], axis=0),
        ddq=np.zeros((every * shape[0], shape[1])),
        run="",
        temperature=np.tile(np.concatenate(known), (every, 1)) if len(known) == len(states) else None,
    )
    load = np.tile(_load(twin, states), (every, 1)) if any(effect.needs for effect in laws) else np.zeros_like(probe.q)
    parts = []
    for effect in laws:
        columns = effect.columns(twin.robot, probe, Predicted(load))
        if effect.stage == 0:
            load = load + columns @ [twin.value(effect.id, term) for term in effect.terms(twin.robot)]
        parts.append(columns.reshape(every, shape[0], shape[1], -1).mean(axis=1))
    return np.concatenate(parts, axis=2)


def _load(twin: Twin, states: Sequence[Motion]) -> np.ndarray:
    """Return the torque (N, n) in the joints that is no friction, by what depends on the state alone."""
    stack = Stack(
        twin.robot,
        [
            effect
            for effect in twin.standing
            if effect.channel == "torque" and effect.family != "friction" and not effect.memory and effect.stage == 0
        ],
    )
    return np.concatenate([stack.real_torque(state, twin.values(stack.torque_terms)) for state in states])


def _residual(twin: Twin, motion: Motion) -> np.ndarray:
    """Return measured torque less the twin's (N, n), NaN where none was measured or a joint stood still."""
    measured = twin.measured_torque(motion)
    if measured is None:
        return np.full(motion.dq.shape, np.nan)
    expected = twin.torque(motion)
    left = measured - (low_pass(expected, motion.rate, motion.cutoff) if motion.cutoff else expected)
    return np.where(twin.stack.undecided(motion), np.nan, left)


def _binned(speed: np.ndarray, torque: np.ndarray, edges: np.ndarray) -> MeasuredFriction | None:
    bins = np.where(np.isfinite(torque), np.digitize(speed, edges), 0)
    kept = [inside for k in range(1, len(edges)) if np.count_nonzero(inside := bins == k) >= _FEWEST]
    if not kept:
        return None
    quartiles = np.array([np.quantile(torque[inside], (0.25, 0.75)) for inside in kept])
    return MeasuredFriction(
        speed=tuple(float(speed[inside].mean()) for inside in kept),
        torque=tuple(float(torque[inside].mean()) for inside in kept),
        low=_listed(quartiles[:, 0]),
        high=_listed(quartiles[:, 1]),
    )


def _numbers(twin: Twin, effects: set[str], joint: str) -> tuple[FrictionNumber, ...]:
    return tuple(
        FrictionNumber(
            parameter.effect, parameter.name, parameter.value, parameter.unit, parameter.lower, parameter.upper
        )
        for parameter in twin.stated
        if parameter.joint == joint
        and parameter.effect in effects
        and parameter.lower is not None
        and parameter.upper is not None
    )


def _listed(values: np.ndarray) -> Numbers:
    return tuple(values.tolist())
