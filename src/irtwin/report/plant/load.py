"""When a meter's energy is taken: by weekday and hour, and by shift, in the plant's time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from datetime import timedelta
from zoneinfo import ZoneInfo

from irtwin.report.questions import Row

WEEKDAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
EARLY, LATE, NIGHT, WEEKEND = "early, 6 to 14 h", "late, 14 to 22 h", "night, 22 to 6 h", "Saturday and Sunday"
_HOUR = timedelta(hours=1)


@dataclass(frozen=True)
class HourOfWeek:
    """The hours of one weekday and time of day: their mean energy (J), None where none was logged; `height` 0 to 1."""

    weekday: str
    hour: int
    energy_j: float | None
    height: float


@dataclass(frozen=True)
class Shift:
    """The hours of a shift: how many, and their energy (J)."""

    name: str
    hours: int
    energy_j: float


@dataclass(frozen=True)
class Load:
    """When energy was taken: `week` a row a weekday, 24 cells each; the shifts in which something was logged."""

    week: tuple[tuple[HourOfWeek, ...], ...]
    shifts: tuple[Shift, ...]

    @property
    def greatest(self) -> HourOfWeek:
        """The weekday and hour with the greatest mean energy."""
        return max((cell for row in self.week for cell in row), key=lambda cell: cell.energy_j or 0.0)


def load(rows: Iterable[Row], zone: ZoneInfo) -> Load | None:
    """Add up the hours that `load.rq` answers; None where it answers none."""
    powers: dict[tuple[int, int], list[float]] = defaultdict(list)
    for row in rows:
        for number, joules in enumerate(map(float, row["by_hour"].split(","))):
            moment = (row["first_hour"] + number * _HOUR).astimezone(zone)
            powers[moment.weekday(), moment.hour].append(joules)
    if not powers:
        return None
    means = {at: sum(energies) / len(energies) for at, energies in powers.items()}
    greatest = max(means.values())
    week = tuple(
        tuple(_cell(weekday, hour, means.get((weekday, hour)), greatest) for hour in range(24)) for weekday in range(7)
    )
    shifts = (
        Shift(name, sum(map(len, hours)), sum(map(sum, hours)))
        for name in (EARLY, LATE, NIGHT, WEEKEND)
        if (hours := [energies for at, energies in powers.items() if _shift(*at) == name])
    )
    return Load(week, tuple(shifts))


def _cell(weekday: int, hour: int, energy: float | None, greatest: float) -> HourOfWeek:
    height = max(energy or 0.0, 0.0) / greatest if greatest > 0 else 0.0
    return HourOfWeek(WEEKDAYS[weekday], hour, energy, height)


def _shift(weekday: int, hour: int) -> str:
    """Return the shift of an hour; a night belongs to the day that it falls on."""
    if weekday >= 5:
        return WEEKEND
    return EARLY if 6 <= hour < 14 else LATE if 14 <= hour < 22 else NIGHT
