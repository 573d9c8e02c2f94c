"""How sure a cause is, from its evidence."""

from __future__ import annotations

import math

# Logistic regression on the causes named in 836 development cases of bench/blind: 607 causes, 80 % of them right
_CONSTANT = 2.780
_PER_T = 0.023
_MOST_T = 10.0
_PER_CLOSED = 1.513
_PER_GAIN = 0.982  # natural logarithm, up to the mean square of what was left
_LEAST_GAIN = 1e-3
_PER_SHARE = 0.356  # natural logarithm of the gain over the largest cause's
_PER_COUNT = -2.416  # natural logarithm: where many causes are named, forms that differ are among them
_UNEXPLAINED = -2.640  # what leaves most of the gap is seldom its cause


def confidence(t: float, gain: float, closed: float, share: float, count: int, *, unexplained: bool) -> float:
    """Return the chance that a cause is right.

    t: of its gain, between groups of runs; gain: of weighted squares, a row; closed: the part of the gap that all
    causes close where it acts, 0 to 1; share: its gain over that of the largest cause, above 0 to 1; count: of all
    causes; `unexplained`: the verdict on all causes together.
    """
    logit = _CONSTANT + _PER_T * min(max(t, 0.0), _MOST_T) + _PER_CLOSED * closed
    logit += (
        _PER_GAIN * math.log(min(max(gain, _LEAST_GAIN), 1.0))
        + _PER_SHARE * math.log(share)
        + _PER_COUNT * math.log(count)
    )
    return 1 / (1 + math.exp(-logit - _UNEXPLAINED * unexplained))
