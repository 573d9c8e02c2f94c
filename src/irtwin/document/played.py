"""What a diagnosis says of a simulator that was told the commands of logs: numbers of servos, and tracking error.

Tracking error is the root of the mean square, over samples and joints, of what the robot's positions have beyond the
simulator's: rad, m of a joint that slides.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from irtwin.document.words import Joint, Run

Interval = tuple[float, float]  # 95 %


@dataclass(frozen=True, kw_only=True)
class Number:
    """A number of a joint's servo that the robot has another of; `interval95` is that of the robot's, in `unit`."""

    effect: str
    joint: Joint
    name: str
    unit: str
    simulator: float
    robot: float
    change: float
    interval95: Interval | None
    log_odds: float


@dataclass(frozen=True, kw_only=True)
class Tracking:
    """Tracking error over all joints, of each joint, and of the flange's place, m."""

    rms: float
    joints: Mapping[Joint, float]
    flange: float


@dataclass(frozen=True, kw_only=True)
class PlayedRun:
    """Tracking error of a run played as a whole: by the simulator, with all numbers, and with those of other runs."""

    before: Tracking
    after: Tracking
    held_out: Tracking | None


@dataclass(frozen=True, kw_only=True)
class Added:
    """Tracking error of the stretches that were fitted, before and after an effect's numbers join those before it."""

    effect: str
    before: float
    after: float


@dataclass(frozen=True, kw_only=True)
class Horizon:
    """Tracking error of all runs so many seconds after they were begun anew as the robot was."""

    seconds: float
    before: float
    after: float


@dataclass(frozen=True, kw_only=True)
class Played:
    """Runs whose commands a simulator was told, freely, and begun anew each half second."""

    simulator: str
    runs: Mapping[Run, PlayedRun]
    before: float
    after: float
    held_out: float | None
    added: tuple[Added, ...]
    restarted: tuple[Horizon, ...]
    numbers: tuple[Number, ...]
