"""Whether reference runs are of the robot whose gap is to be diagnosed: one whose torque is nothing like it is not."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.stack import Stack
from irtwin.errors import InputError
from irtwin.gap.regression.cholesky import factored, solved
from irtwin.gap.regression.moments import Moments, Summed
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.thresholds import Data
from irtwin.robot.description import Robot
from irtwin.signals.channels import CHANNELS
from irtwin.signals.log import Run

_ANY = 100.0  # times what bodies may be off
_OF_BODY = 10  # parameters: mass, first moments, inertia
_AS_MUCH, _COMPARABLE = 2.0, 10.0  # times: friction that only has another sign, and friction beside which it is none


def check_same_robot(runs: Sequence[Run], stack: Stack, system: System, limits: Data) -> None:
    """Raise InputError where the torque of the other runs (reference, simulated) is nothing like the observed.

    `system` holds the twin's terms alone. What changes a healthy robot shows in one joint, or bodies that both sides
    have in common explain it; of another robot they are wrong in several, or friction drives half of its joints. Where
    the same friction drives, the torque has the other sign.
    """
    if not system.both:
        return
    others = [run for run in runs if run.role != "observed"]
    system = _with_any_bodies(system)
    moments = system.moments(system.noise_before)
    seen = system.group_observed
    sides = [Summed([m for m, own in zip(moments, seen, strict=True) if own == side]) for side in (True, False)]
    own, other = (system.solution((), side) for side in sides)
    foreign = _foreign_share(system, sides, (own, other)) > limits.foreign[others[0].role]
    opposed, reversed_here = _opposed(stack.robot, system, own, other)
    for role, some in {"observed": reversed_here < 0, others[0].role: reversed_here > 0}.items():
        if some.any():
            file = next(run.file for run in runs if run.role == role)
            columns = CHANNELS["torque"].columns(np.array(stack.robot.joint_names)[some])
            raise InputError(
                f"{file}: the sign of {', '.join(columns)} is reversed in the {role} runs, as friction drives there; "
                "change it in these runs"
            )
    if foreign.sum() > 1 or opposed.mean() >= 0.5:
        named = [name for k, name in enumerate(stack.robot.joint_names) if foreign[k] or opposed[k]]
        raise InputError(
            f"{others[0].file}: the torque of the {others[0].role} runs is nothing like that of the observed runs (on "
            f"{', '.join(named)}), as of another robot, unit or sign; mend these runs, or leave them out"
        )


def _with_any_bodies(system: System) -> System:
    """Return the system with bodies of which hardly anything is known: another robot's, or those of another unit."""
    terms = (
        (effect, replace(term, spread=_ANY * term.spread) if effect.bodies else term) for effect, term in system.terms
    )
    return replace(system, terms=tuple(terms), prior_rows=None)


def _foreign_share(system: System, sides: Sequence[Moments], alone: Sequence[np.ndarray]) -> np.ndarray:
    """Return how much of each joint's mean square (n,) bodies that both sides have in common leave of either.

    `sides`: the observed runs and the others; `alone`: coefficients (D,) of each. Friction, offsets and rotors are
    fitted to each, and a load may have come or gone; what a side's own bodies leave too is not counted. Where one side
    hardly shows a body, the other's may be it.
    """
    nothing = np.zeros(len(alone[0]))
    nothing[: system.base] = -system.expected / system.scale[: system.base]
    share = np.zeros(len(system.pattern))
    for common, own, seen in zip(_with_common_bodies(system, sides), alone, (True, False), strict=True):
        groups = np.flatnonzero(system.group_observed == seen)
        left, least, most = (sum(system.squares(values, int(k)) for k in groups) for values in (common, own, nothing))
        share += (left - least) / np.maximum(most, np.finfo(float).tiny)
    return share


def _with_common_bodies(system: System, sides: Sequence[Moments]) -> Iterator[np.ndarray]:
    """Yield each side's coefficients (D,) of the best fit with common bodies, but for the last, which a load joins."""
    common = np.flatnonzero([effect.bodies for effect, _ in system.terms])[:-_OF_BODY]
    free = np.setdiff1d(np.arange(system.base), common)
    inside, count = np.concatenate([common, free]), len(common) + len(sides) * len(free)
    products, right, places = np.zeros((count, count)), np.zeros(count), []
    for k, side in enumerate(sides):
        first = len(common) + k * len(free)
        places.append(np.concatenate([np.arange(len(common)), np.arange(first, first + len(free))]))
        own = side.of(inside)
        products[np.ix_(places[-1], places[-1])] += own[:, inside] + system.prior()[np.ix_(inside, inside)]
        right[places[-1]] += own[:, -1]
    values = solved(factored(products, np.zeros_like(products)), right)
    for own in places:
        vector = np.zeros(system.size)
        vector[inside] = values[own]
        yield vector


def _opposed(robot: Robot, system: System, own: np.ndarray, other: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return on which joints (n,) all friction drives in one kind of run and brakes in the other.

    Beside it (n,): -1 where as much of it drives in the observed runs, 1 where it does in the others, else 0.
    """
    opposed, alike = [], []
    for joint in robot.joint_names:
        places = [
            k
            for k, (effect, term) in enumerate(system.terms)
            if effect.family == "friction" and effect.id in BASELINE and term.joint == joint
        ]
        seen = own[places] + system.expected[places] / system.scale[places]
        elsewhere = other[places] + system.expected[places] / system.scale[places]
        reversed_here = bool(places) and bool(np.all(elsewhere * seen < 0))
        times = np.exp(np.abs(np.log(-seen / elsewhere)).max()) if reversed_here else np.inf
        opposed.append(bool(times < _COMPARABLE))
        alike.append(np.sign(seen.sum()) if times < _AS_MUCH else 0.0)
    return np.array(opposed), np.array(alike)
