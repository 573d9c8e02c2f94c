"""What the twin left of a run's torque, before any effect is tried."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class Remainder:
    """What the twin left of one run's torque: residual (N, n) N m, NaN where undecided."""

    motion: Motion
    residual: np.ndarray
    observed: bool
    label: str  # of the programmed motion: repeats share it
