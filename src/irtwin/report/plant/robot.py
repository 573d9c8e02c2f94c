"""What the pages of one robot and of one run need beside the rows of their questions, and their tables as files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from zoneinfo import ZoneInfo

from irtwin.report.plant import page
from irtwin.report.plant.energies import by_day, days, kind, share
from irtwin.report.plant.load import load
from irtwin.report.plant.overview import PLANT_TREND
from irtwin.report.plant.sheet import Sheet
from irtwin.report.questions import Answers, PageQuestion, Row

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
