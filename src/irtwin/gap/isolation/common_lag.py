"""The lag of all joints' torque behind positions, as filters of drives and of loggers make it: no gap of the twin.

It is found as a cause is, beside what else acts; the search is then repeated without it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.effects.sensing import TimeDelay
from irtwin.gap.isolation.finding import ChannelFinding, quantities
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion

_LONGEST = 5e-3  # s, or a sample, where that is longer: filters of drives pass 100 Hz and more


def common_lag(robot: Robot, finding: ChannelFinding, motions: Sequence[Motion]) -> float | None:
    """Return by how much torque comes later in more than half of the joints, in all runs, s: the median of these.

    None where none is found, or where it is longer than filters and samples make it.
    """
    for cause in finding.causes:
        late = isinstance(cause.variants[0].effect, TimeDelay) and cause.scope == "missing"
        if late and 2 * len(cause.touched(robot)) > len(robot.joints):
            lag = float(np.median([one.value for one in quantities(robot, finding, cause)]))
            return lag if lag <= max(_LONGEST, *(1 / motion.rate for motion in motions)) else None
    return None
