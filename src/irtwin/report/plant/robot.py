"""What the pages of one robot and of one run need beside the rows of their questions, and their tables as files."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from datetime import timedelta
from typing import Any
from zoneinfo import ZoneInfo

from irtwin.report.plant import page
from irtwin.report.plant.energies import by_day, days, kind, share
from irtwin.report.plant.overview import PLANT_TREND
from irtwin.report.plant.sheet import Sheet
from irtwin.report.questions import Answers, PageQuestion, Row

WEEKDAYS = ("Monday", "Tuesday", "Wednesday", "Thursday", "Friday", "Saturday", "Sunday")
EARLY, LATE, NIGHT, WEEKEND = "early, 6 to 14 h", "late, 14 to 22 h", "night, 22 to 6 h", "Saturday and Sunday"
_HOUR = timedelta(hours=1)
_LITTLE = 1e-4  # of all energies of a run's ledger, by size: less is not shown by itself
MOST_RUNS = 5000  # that runs.rq answers
_OF_THE_PLANT = ("energy", "days", "standstill", "live", "made")  # its questions, asked of one robot
_RUNS = {  # columns of a table by what the question calls them
    "name": "run", "run": "iri", "began": "began_UTC", "time_s": "time_s", "payload_kg": "payload_kg",
    "energy_from": "energy_from", "energy_j": "energy_J", "power_w": "mean_power_W", "peak_w": "peak_power_W",
    "idle_share": "standstill_share_of_time", "standby_j": "standby_J", "standby_share": "standby_share_of_energy",
    "error_percent": "twin_error_percent", "part": "part_in_twin", "planned": "planned",
}  # fmt: skip
_LEDGER = {
    "joint_name": "joint", "effect_name": "effect", "effect": "effect_iri", "energy_j": "energy_J",
    "lower_j": "lower_J", "upper_j": "upper_J",
    "entry": "entry_iri", "entry_j": "entry_J", "entry_lower_j": "entry_lower_J", "entry_upper_j": "entry_upper_J",
}  # fmt: skip


def questions() -> Mapping[str, PageQuestion]:
    """Return the questions of a robot's page."""
    of_the_plant = page.questions()
    beside = {name: replace(of_the_plant[name], bind=("robot",)) for name in _OF_THE_PLANT}
    return {**page.questions("robot"), **beside, "tariff": of_the_plant["tariff"]}


def all_runs() -> PageQuestion:
    """Return the question of a robot's runs without the bound that its page has."""
    runs = page.questions("robot")["runs"]
    return replace(runs, text=runs.text.removesuffix(f"LIMIT {MOST_RUNS}"))


def of_robot(answers: Answers, zone: ZoneInfo) -> dict[str, Any]:
    """Return what a robot's page says of the answers to its questions, by the plant's clock."""
    energies = sorted(
        answers["energy"].rows, key=lambda row: (not kind(row["energy_from"]).electrical, row["energy_from"])
    )
    daily = {of: by_date for (_, of), by_date in by_day(answers["days"].rows).items()}
    standing = answers["standstill"].first
    return {
        "energies": [
            (kind(row["energy_from"]), row, days(daily.get(row["energy_from"], {}), PLANT_TREND)) for row in energies
        ],
        "standing": share(standing["idle_s"], standing["known_s"]) if standing else None,
        "most_runs": MOST_RUNS,
        "load": load(answers["load"].rows, zone),
    }


def load(rows: Iterable[Row], zone: ZoneInfo) -> dict[str, Any] | None:
    """Say when a meter's energy is taken, of the hours that `load.rq` answers; None where it answers none.

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


def of_run(answers: Answers) -> dict[str, Any]:
    """Return what a run's page says of the answers to its questions."""
    run = answers["run"].first
    assert run is not None
    entries: dict[str, list[Row]] = {}  # what the data do not part is one
    for row in answers["ledger"].rows:
        entries.setdefault(row["entry"], []).append(row)
    ranked = sorted(entries.values(), key=lambda entry: -abs(entry[0]["entry_j"]))
    least = _LITTLE * sum(abs(entry[0]["entry_j"]) for entry in ranked)
    return {
        "of": kind(run["energy_from"]) if run["energy_j"] is not None else None,
        "entries": ranked,
        "told": [entry for entry in ranked if abs(entry[0]["entry_j"]) >= least],
    }


def runs_sheet(answers: Answers) -> Sheet:
    """Return a robot's runs, which `runs.rq` answers."""
    return _sheet(answers["runs"].rows, _RUNS)


def ledger_sheet(answers: Answers) -> Sheet:
    """Return a run's energy by joint and effect, which `ledger.rq` answers."""
    return _sheet(answers["ledger"].rows, _LEDGER)


def _sheet(rows: tuple[Row, ...], columns: Mapping[str, str]) -> Sheet:
    return Sheet(tuple(columns.values()), [tuple(row[name] for name in columns) for row in rows])


def _cell(weekday: int, hour: int, energy: float | None, greatest: float) -> dict[str, Any]:
    height = max(energy or 0.0, 0.0) / greatest if greatest > 0 else 0.0
    return {"weekday": WEEKDAYS[weekday], "hour": hour, "energy_j": energy, "height": height}


def _shift(weekday: int, hour: int) -> str:
    """Return the shift of an hour; a night belongs to the day that it falls on."""
    if weekday >= 5:
        return WEEKEND
    return EARLY if 6 <= hour < 14 else LATE if 14 <= hour < 22 else NIGHT
