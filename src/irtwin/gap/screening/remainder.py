"""What the twin left of a run's torque, before any effect is tried."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from irtwin.effects.load import Payload
from irtwin.effects.stack import Stack
from irtwin.gap.data.case import Case
from irtwin.gap.regression.residuals import as_filtered, torque_residual
from irtwin.identification.progress import track
from irtwin.signals.filter import decimation
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class RunResidual:
    """What the twin left of one run's torque: residual (N, n) N m, NaN where undecided."""

    motion: Motion
    residual: np.ndarray
    observed: bool


def remainders(
    case: Case, stack: Stack, values: np.ndarray, load: tuple[Payload, np.ndarray] | None = None
) -> list[RunResidual]:
    """Return what the twin with its coefficients, `values`, leaves of each run; and a `load` (10,) in some, if any."""
    left = []
    for motion in track(case.with_torque, lambda current: f"what is left of {current.run}"):
        step = decimation(motion.rate, motion.cutoff) if motion.cutoff else 1
        residual = torque_residual(stack, motion, values)
        if load is not None and load[0].acts_in(motion):
            residual = residual - as_filtered(motion, load[0].columns(case.robot, motion) @ load[1])
        left.append(RunResidual(_every(motion, step), residual[::step], motion.run in case.observed))
    return left


def _every(motion: Motion, step: int) -> Motion:
    cut = slice(None, None, step)
    return Motion(motion.time[cut], motion.q[cut], motion.dq[cut], motion.ddq[cut], run=motion.run)
