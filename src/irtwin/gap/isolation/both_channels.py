"""What causes of torque close of torque and power together: what the twin imitates in torque shows in both."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irtwin.gap.isolation.apart import Apart, closed_squares
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.closing import Closing, closing
from irtwin.gap.regression.held_out import HeldOut
from irtwin.gap.regression.normal_equations import System


@dataclass(frozen=True)
class BothChannels:
    """What causes of torque close in the equations of both channels; floor: (n + 1,) RMS, power last, or None."""

    apart: Apart
    floor: np.ndarray | None

    @cached_property
    def _held_out(self) -> HeldOut:
        return self.apart.held_out()

    @cached_property
    def _closed_squares(self) -> np.ndarray:
        return closed_squares(self.apart)

    def closing(self, places: Sequence[int], causes: Sequence[FoundCause]) -> Closing:
        """Return what some causes close of both gaps, beside the others; `places` theirs among all of torque."""
        closed, where = self._closed_squares[places].sum(axis=0), acting(causes, observed_groups(self.apart.system))
        fast = self.apart.noise[self.apart.system.halves[0]]
        return replace(closing(closed, where, self._held_out, self.floor, fast), both=True)


def acting(causes: Sequence[FoundCause], groups: Sequence[tuple[str, ...]]) -> np.ndarray:
    """Return (G,) whether causes act in each group of runs at all."""
    runs = [variant.effect.runs for cause in causes for variant in cause.variants]
    return np.array([None in runs or any(set(some or ()) & set(group) for some in runs) for group in groups])


def observed_groups(system: System) -> list[tuple[str, ...]]:
    """Return the runs of each observed group."""
    return [
        tuple(dict.fromkeys(system.blocks[k].run for k in np.flatnonzero(system.group == group)))
        for group in np.flatnonzero(system.group_observed)
    ]
