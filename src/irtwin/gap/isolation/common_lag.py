"""The lag of all joints' torque behind positions, as filters of drives and of loggers make it: no gap of the twin.

It is found as a cause is, beside what else acts; the search is then repeated without it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.effects.sensing import TimeDelay
from irtwin.gap.isolation.finding import ChannelFinding, estimate_of
from irtwin.gap.regression.hypotheses import MISSING
from irtwin.signals.motion import Motion

_LONGEST = 5e-3  # s, or a sample, where that is longer: filters of drives pass 100 Hz and more
_SURE = 2.0  # standard deviations
_SEVERAL = 2  # joints


def common_lag(finding: ChannelFinding, motions: Sequence[Motion]) -> float | None:
    """Return by how much torque comes later in several joints, in all runs, s: the median of these.

    None where no delay is a cause, where as many joints say that theirs comes earlier, or where it is longer than
    filters and samples make it.
    """
    if not any(cause.effect == TimeDelay.id for cause in finding.causes):
        return None
    lags, deviations, unnamed = lags_of_joints(finding)
    late = lags > _SURE * deviations
    if late.sum() < _SEVERAL:
        return None
    lag = float(np.median(lags[late]))
    early = ~late & (lags + _SURE * deviations + unnamed < lag)
    longest = max(_LONGEST, *(1 / motion.rate for motion in motions))
    return lag if lag <= longest and late.sum() > early.sum() else None


def lags_of_joints(finding: ChannelFinding) -> np.ndarray:
    """Return the lag of each joint's torque beside other causes, its deviation, and what it is known to, (3, J) s."""
    own = [one for one in finding.attribution.hypotheses if (one.effect, one.scope) == (TimeDelay.id, MISSING)]
    shortest = [one.variants[0] for one in own]
    columns = [k for variant in shortest for k in variant.columns]
    others = [k for cause in finding.causes if cause.effect != TimeDelay.id for k in cause.columns]
    fitted = estimate_of(finding.steadied.system, [*others, *columns])
    last = slice(len(fitted.values) - len(columns), None)
    known = [term.unnamed for variant in shortest for term in variant.terms]
    return np.array([fitted.values[last], np.sqrt(np.diag(fitted.covariance)[last]), known])
