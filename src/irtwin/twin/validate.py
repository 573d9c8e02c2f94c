"""Judging a twin on measured motions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.identification.validation import energy, energy_error, r_squared, rmse
from irtwin.signals.filter import kernel, low_pass
from irtwin.signals.motion import Motion
from irtwin.twin.twin import Twin


@dataclass(frozen=True)
class RunFit:
    """How a twin does on one run. Torque per joint, (n,), None where no torque was measured; power likewise.

    torque_rmse N m; power_rmse W; measured_energy, modelled_energy J; energy_error % (Yan 2018, eqs. 13 to 15).
    """

    run: str
    torque_rmse: np.ndarray | None
    r_squared: np.ndarray | None
    power_rmse: float | None
    power_r_squared: float | None
    measured_energy: float | None
    modelled_energy: float
    energy_error: float | None


def validate(twin: Twin, motions: Sequence[Motion]) -> tuple[RunFit, ...]:
    """Compare what the twin says with what was measured, run by run.

    The model passes the filter that the measurement went through; half its kernel at either end of a run is left
    out of the comparison of torque and power (not of energy).
    """
    return tuple(_judge(twin, motion) for motion in motions)


def _judge(twin: Twin, motion: Motion) -> RunFit:
    power = twin.power(motion)
    modelled = energy(motion.time, power)
    measured = None if motion.power is None else energy(motion.time, motion.power)
    shown = twin.measured_torque(motion)
    torque = None if shown is None else _pair(motion, shown, twin.torque(motion))
    watts = None if motion.power is None else _pair(motion, motion.power, power)
    return RunFit(
        run=motion.run,
        torque_rmse=None if torque is None else rmse(*torque),
        r_squared=None if torque is None else r_squared(*torque),
        power_rmse=None if watts is None else float(rmse(*watts)),
        power_r_squared=None if watts is None else float(r_squared(*watts)),
        measured_energy=measured,
        modelled_energy=modelled,
        energy_error=None if measured is None else energy_error(measured, modelled),
    )


def _pair(motion: Motion, measured: np.ndarray, modelled: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return measured and modelled in the same band, away from the ends."""
    if motion.cutoff is None:
        return measured, modelled
    half = min(len(kernel(motion.rate, motion.cutoff)) // 2, len(measured) // 4)
    inner = slice(half, len(measured) - half)
    return measured[inner], low_pass(modelled, motion.rate, motion.cutoff)[inner]
