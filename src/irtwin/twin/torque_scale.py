"""The scale of torque that a twin was fitted with: how sure it is, and what goes with it.

All torques may be off by one share, as drives' constants are nominal. A fit does not see that, so a twin's covariance
does not hold it: what is common to all parameters is no noise of each.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.effect import Quantity

_FORCES = re.compile(r"\b(?:kg|N)\b")
_POWER_OF = re.compile(r"\)\^(\d+)$")


@dataclass(frozen=True)
class TorqueScale:
    """Half the 95 % interval of logged torque over that which is there, a share, and where that comes from.

    low, high: the ends of what true torque is over logged torque; `why` says all of it in words.
    """

    uncertainty: float
    source: str
    low: float
    high: float
    why: str

    def interval(self, value: float, unit: str, lower: float | None, upper: float | None) -> tuple[float, float] | None:
        """Return a 95 % interval of noise with the scale in it; None where nothing changes: it does not go with torque.

        Both are added in quadrature, on each side by itself.
        """
        degree = torque_degree(unit)
        if degree == 0 or self.uncertainty == 0 or lower is None or upper is None:
            return None
        ends = sorted(value * factor**degree for factor in (self.low, self.high))
        below, above = max(value - ends[0], 0.0), max(ends[1] - value, 0.0)
        return value - float(np.hypot(value - lower, below)), value + float(np.hypot(upper - value, above))

    def widened(self, one: Quantity) -> Quantity:
        """Return a quantity with the scale in its interval; one that does not go with torque as it is."""
        found = self.interval(one.value, one.unit, one.lower, one.upper)
        return one if found is None else replace(one, lower=found[0], upper=found[1])


def torque_degree(unit: str) -> int:
    """Return the power of torque that a quantity of this unit goes with: kg and N m 1, W/(N m)^2 -2, rad 0."""
    above, _, below = unit.partition("/")
    return _degree(above) - _degree(below)


def _degree(part: str) -> int:
    if not _FORCES.search(part):
        return 0
    power = _POWER_OF.search(part)
    return int(power[1]) if power else 1
