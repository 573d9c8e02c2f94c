"""The cutoff of the low-pass filter that all runs of a data set pass."""

from __future__ import annotations

from collections.abc import Sequence

from irtwin.errors import InputError
from irtwin.signals.channels import Signals
from irtwin.signals.filter import FEWEST_PERIODS
from irtwin.signals.sampling import interval


def checked_cutoff(hz: float, runs: Sequence[Signals], said: str) -> float:
    """Return a stated cutoff, Hz. Raises InputError, beginning with `said`, where runs cannot be filtered with it."""
    longest = max(float(run.time[-1] - run.time[0]) for run in runs)
    least, most = FEWEST_PERIODS / longest, min(0.5 / interval(run.time) for run in runs)
    if not least <= hz < most:
        raise InputError(
            f"{said} should be at least {least:.3g} Hz, {FEWEST_PERIODS} periods in the longest run, and below "
            f"{most:.4g} Hz, half the slowest sampling rate, not {hz:g} Hz"
        )
    return hz
