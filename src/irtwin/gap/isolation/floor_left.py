"""The noise floor beside causes: what repeats of one motion differ by once what causes add is taken off."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import REPEATS, Floor, noise_floor
from irtwin.gap.isolation.explained import ExplainedTorque
from irtwin.gap.regression.cross_fitted import PowerOf
from irtwin.gap.regression.residuals import as_filtered
from irtwin.signals.motion import Motion

_LOWER = 0.95  # of the floor: by less it may be lower by chance


def floor_left(case: Case, floor: Floor, explained: ExplainedTorque, power_of: PowerOf | None) -> Floor:
    """Return the floor that the causes of torque leave; itself where that is no lower.

    A cause that acts in one run and not in its repeat, a payload for one, is in the difference of the two. `power_of`
    says what the joint torque takes, None where power was not measured.
    """
    if floor.source != REPEATS:
        return floor

    def without(motion: Motion) -> Motion:
        added = sum(explained.added(cause, motion) for cause in explained.finding.causes)
        torque = None if motion.torque is None else motion.torque - as_filtered(motion, np.asarray(added))
        if power_of is None or motion.power is None:
            return replace(motion, torque=torque)
        whole = explained(motion)
        real = sum(explained.added(cause, motion, real=True) for cause in explained.finding.causes)
        taken = power_of(motion, whole)[0] - power_of(motion, whole - real)[0]
        return replace(motion, torque=torque, power=motion.power - as_filtered(motion, taken))

    left = noise_floor(case.runs, {run: without(motion) for run, motion in case.motions.items()}, case.thresholds.data)
    before = _together(floor)
    found = replace(floor, torque=_least(floor.torque, left.torque), power=_least(floor.power, left.power))
    return found if (_together(found) < _LOWER * before).any() else floor


def _least(before: Any, after: Any) -> Any:
    return before if before is None or after is None else np.minimum(before, after)


def _together(floor: Floor) -> np.ndarray:
    return np.append([] if floor.torque is None else floor.torque, [] if floor.power is None else floor.power)
