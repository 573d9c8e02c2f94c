"""The noise floor beside causes: what repeats of one motion differ by once what causes add is taken off."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import REPEATS, Floor, noise_floor
from irtwin.gap.isolation.explained import Explained
from irtwin.gap.regression.cross_fitted import PowerOf

_LOWER = 0.95  # of the floor: by less it may be lower by chance


def floor_left(case: Case, floor: Floor, explained: Explained, power_of: PowerOf | None = None) -> Floor:
    """Return the floor that the causes of a channel leave; itself where that is no lower.

    A cause that acts in one run and not in its repeat, a payload for one, is in the difference of the two. `power_of`
    says what joint torque takes; None: causes of torque leave the power as it is.
    """
    if floor.source != REPEATS:
        return floor
    motions = {run: explained.off(motion, power_of) for run, motion in case.motions.items()}
    left = noise_floor(case.runs, motions, case.thresholds.data)
    before = _together(floor)
    found = replace(floor, torque=_least(floor.torque, left.torque), power=_least(floor.power, left.power))
    return found if (_together(found) < _LOWER * before).any() else floor


def _least(before: Any, after: Any) -> Any:
    return before if before is None or after is None else np.minimum(before, after)


def _together(floor: Floor) -> np.ndarray:
    return np.append([] if floor.torque is None else floor.torque, [] if floor.power is None else floor.power)
