"""How sure a cause is, from its evidence."""

from __future__ import annotations

import math

# Set by judgement, not yet calibrated on the benchmark's development seeds: logit of the chance that a cause is right
_CONSTANT = -0.5
_PER_GAIN = 1.0  # natural logarithm of the gain over what matters
_PER_T = 0.25
_MOST_T = 8.0
_HIGHEST = 0.98


def confidence(gain: float, least: float, t: float, rivals: int) -> float:
    """Return the chance that a cause is right: rises with its gain (over the `least` that matters) and its t.

    Rivals that explain it as well share the chance.
    """
    logit = _CONSTANT + _PER_GAIN * math.log(max(gain / least, 1.0)) + _PER_T * min(max(t, 0.0), _MOST_T)
    return min(_HIGHEST, 1 / (1 + math.exp(-logit))) / (1 + rivals)
