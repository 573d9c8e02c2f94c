"""What is proposed to save energy, what of it was done, and what that saved by the runs before and after."""

from __future__ import annotations

from irtwin.report.plant.choice import ALL, Selection
from irtwin.report.plant.energies import kwh
from irtwin.report.plant.sheet import Sheet
from irtwin.report.questions import Answers, Row


def actions(answers: Answers, asked: Selection = ALL) -> tuple[Row, ...]:
    """Return what `actions.rq` answers of those `robots.rq` that are asked for."""
    robots = {robot["robot"] for robot in answers["robots"].rows if asked.finds(robot)}
    return tuple(row for row in answers["actions"].rows if row["robot"] in robots)


def actions_sheet(rows: tuple[Row, ...]) -> Sheet:
    """Return the actions as a table."""
    columns = (
        "robot", "action", "place", "state", "done_on", "by", "saving_a_year_kWh", "saving_a_run_kWh", "runs_before",
        "runs_after", "compared_for_each", "baseline_adjusted_kWh", "saved_kWh", "lower_kWh", "upper_kWh", "iri",
    )  # fmt: skip
    return Sheet(columns, [_cells(row) for row in rows])


def _cells(row: Row) -> tuple[str | int | float | None, ...]:
    head = (row["name"], row["what"], row["place"], row["state"], row["done_on"], row["by"], kwh(row["year_j"]))
    energies = (kwh(row[name]) for name in ("adjusted_j", "saved_j", "lower_j", "upper_j"))
    return *head, kwh(row["run_j"]), row["before"], row["after"], row["unit"], *energies, row["action"]
