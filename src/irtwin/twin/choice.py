"""The choice: an effect that data show of a robot, or could not tell, and what it is worth."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Choice:
    """An effect of the catalogue: whether the twin has it by what data show, at which joints, and how sure that is.

    What is not `chosen` could not be told: neither that it is there nor that it is not. `joints`: none for an effect of
    the whole robot, or of all joints alike. `rivals`: other effects that could be in its place.
    On groups of runs that are left out of the fit in turn, without the effect and with it: `rmse`, in `unit`, of the
    channel that shows it, at the joint that gains most; `energy_error`, % in the mean; None where nothing tells.
    """

    effect: str
    joints: tuple[str, ...]
    chosen: bool
    probability: float
    rivals: tuple[str, ...] = ()
    unit: str | None = None
    rmse_without: float | None = None
    rmse_with: float | None = None
    energy_error_without: float | None = None
    energy_error_with: float | None = None
