"""When a meter's energy is taken: by weekday and hour, and by shift, in the plant's time."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from datetime import timedelta
from typing import Any
from zoneinfo import ZoneInfo

from irtwin.report.questions import Row

WEEKDAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
EARLY, LATE, NIGHT, WEEKEND = "early, 6 to 14 h", "late, 14 to 22 h", "night, 22 to 6 h", "Saturday and Sunday"
_HOUR = timedelta(hours=1)


def load(rows: Iterable[Row], zone: ZoneInfo) -> dict[str, Any] | None:
    """Add up the hours that `load.rq` answers; None where it answers none.

    `week` has a row a weekday, 24 cells each: their mean `energy_j`, None where none was logged, and `height`, 0 to 1;
    the `greatest` cell is named. `shifts` are those in which something was logged, with their `hours` and `energy_j`.
    """
    powers: dict[tuple[int, int], list[float]] = defaultdict(list)
    for row in rows:
        for number, joules in enumerate(map(float, row["by_hour"].split(","))):
            moment = (row["first_hour"] + number * _HOUR).astimezone(zone)
            powers[moment.weekday(), moment.hour].append(joules)
    if not powers:
        return None
    means = {at: sum(energies) / len(energies) for at, energies in powers.items()}
    greatest = max(means.values())
    week = [[_cell(weekday, hour, means.get((weekday, hour)), greatest) for hour in range(24)] for weekday in range(7)]
    shifts = [
        {"name": name, "hours": sum(map(len, hours)), "energy_j": sum(map(sum, hours))}
        for name in (EARLY, LATE, NIGHT, WEEKEND)
        if (hours := [energies for at, energies in powers.items() if _shift(*at) == name])
    ]
    cells = (cell for row in week for cell in row)
    return {"week": week, "shifts": shifts, "greatest": max(cells, key=lambda cell: cell["energy_j"] or 0.0)}


def _cell(weekday: int, hour: int, energy: float | None, greatest: float) -> dict[str, Any]:
    height = max(energy or 0.0, 0.0) / greatest if greatest > 0 else 0.0
    return {"weekday": WEEKDAYS[weekday], "hour": hour, "energy_j": energy, "height": height}


def _shift(weekday: int, hour: int) -> str:
    """Return the shift of an hour; a night belongs to the day that it falls on."""
    if weekday >= 5:
        return WEEKEND
    return EARLY if 6 <= hour < 14 else LATE if 14 <= hour < 22 else NIGHT
