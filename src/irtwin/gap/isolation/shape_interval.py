"""Numbers of an effect's shape, of which a few values are tried: with intervals, and once where joints share them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace

import numpy as np

from irtwin.effects.effect import Effect, Quantity
from irtwin.robot.description import Robot


def with_shape(
    quantities: Iterable[Quantity], robot: Robot, effect: Effect, likely: Sequence[Effect], *, shared: bool
) -> list[Quantity]:
    """Return an effect's quantities, those of its shape with the interval of the `likely` shapes.

    `shared`: joints have one shape together; it is said once, of no joint.
    """
    stated = []
    for quantity in quantities:
        if (
            quantity.lower is None
            and quantity.value == effect.shape.get(quantity.name)
            and quantity.name in effect.ranges
        ):
            lower, upper = _interval(quantity.name, robot, effect, likely)
            joint = None if shared else quantity.joint
            quantity = replace(quantity, joint=joint, lower=lower, upper=upper)
        stated.append(quantity)
    return list(dict.fromkeys(stated))


def _interval(name: str, robot: Robot, effect: Effect, likely: Sequence[Effect]) -> tuple[float | None, float | None]:
    """Return what the likely shapes hold: a value stands for all that are nearer to it, by ratio, than to another.

    None, None where values are found by a screening, and not chosen out of the effect's `candidates`.
    """
    least, most = effect.ranges[name]
    if effect.screened or not likely or least <= 0:
        return None, None
    alike = effect, *(shape for shape in likely if isinstance(shape, type(effect)))
    tried = np.unique([getattr(shape, name) for shape in (*effect.candidates(robot), *alike)])
    edges = [min(least, tried[0]), *np.sqrt(tried[:-1] * tried[1:]), max(most, tried[-1])]
    own = np.searchsorted(tried, [getattr(shape, name) for shape in alike])
    return float(edges[own.min()]), float(edges[own.max() + 1])
