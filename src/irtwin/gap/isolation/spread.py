"""The spread of reference runs: what some of them leave over the others, as observed runs may without any change."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from irtwin.gap.regression.groups import FEWEST_GROUPS
from irtwin.gap.regression.normal_equations import System, noise_before

_DRAWN = 32  # partitions into halves; of five groups there are ten


def spread(system: System, floor: np.ndarray) -> float | None:
    """Return the largest excess, in floors squared, of a half of the reference groups over the other half.

    Each half in turn plays the observed runs: what a fit to both leaves in it is held against what a fit to the other
    half leaves there, or the floor (g,) RMS if that is more, in rows in which no dry friction turns. The largest of all
    equations and halves; None where the groups are fewer than four.
    """
    groups = [int(group) for group in np.flatnonzero(~system.group_observed)]
    if len(groups) < FEWEST_GROUPS:
        return None
    noise = noise_before(system)

    def left(fitted: Sequence[int], of: Sequence[int]) -> np.ndarray:
        return system.rms((), noise, fitted, of)[system.halves[0]]

    def excess(played: Sequence[int], others: Sequence[int]) -> float:
        return float(np.max((left(groups, played) / np.maximum(floor, left(others, others))) ** 2 - 1))

    return max(excess(*halves) for halves in _halves(groups))


def _halves(groups: list[int]) -> Iterator[tuple[list[int], list[int]]]:
    """Yield each partition into halves that is drawn, both ways round."""
    generator = np.random.default_rng(0)
    drawn = (generator.permutation(groups)[: len(groups) // 2] for _ in range(_DRAWN))
    for half in dict.fromkeys(frozenset(some.tolist()) for some in drawn):
        first, second = sorted(half), sorted(set(groups) - half)
        yield first, second
        yield second, first
