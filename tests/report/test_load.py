"""When a meter's energy is taken, by weekday, hour and shift."""

from __future__ import annotations

from datetime import UTC, datetime
from zoneinfo import ZoneInfo

from irtwin.report.plant.load import EARLY, NIGHT, WEEKEND, load

FRIDAY = datetime(2026, 3, 6, 22, tzinfo=UTC)


def test_hours_are_those_of_the_plants_clock() -> None:
    rows = [{"first_hour": FRIDAY, "by_hour": "10,20,40"}]
    found = load(rows, ZoneInfo("UTC"))
    taken = {(cell["weekday"], cell["hour"]): cell["energy_j"] for row in found["week"] for cell in row}
    assert {at: energy for at, energy in taken.items() if energy} == {
        ("Friday", 22): 10.0, ("Friday", 23): 20.0, ("Saturday", 0): 40.0
    }  # fmt: skip
    assert [(shift["name"], shift["hours"], shift["energy_j"]) for shift in found["shifts"]] == [
        (NIGHT, 2, 30.0),
        (WEEKEND, 1, 40.0),
    ]
    assert found["greatest"] == {"weekday": "Saturday", "hour": 0, "energy_j": 40.0, "height": 1.0}
    tokyo = load(rows, ZoneInfo("Asia/Tokyo"))
    assert [shift["name"] for shift in tokyo["shifts"]] == [WEEKEND]


def test_the_same_hour_of_several_weeks_is_its_mean() -> None:
    mondays = [datetime(2026, 3, day, 6, tzinfo=UTC) for day in (2, 9)]
    rows = [{"first_hour": day, "by_hour": energy} for day, energy in zip(mondays, ("10", "30"), strict=True)]
    found = load(rows, ZoneInfo("UTC"))
    assert found["week"][0][6]["energy_j"] == 20.0
    assert [(shift["name"], shift["hours"], shift["energy_j"]) for shift in found["shifts"]] == [(EARLY, 2, 40.0)]


def test_nothing_and_nothing_taken() -> None:
    assert load([], ZoneInfo("UTC")) is None
    found = load([{"first_hour": FRIDAY, "by_hour": "0"}], ZoneInfo("UTC"))
    assert found["greatest"]["height"] == 0.0
