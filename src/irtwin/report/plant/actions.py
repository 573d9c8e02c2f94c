"""What is proposed to save energy, what of it was done, and what that saved by the runs before and after."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

from irtwin.report.plant.choice import ALL, Selection
from irtwin.report.plant.energies import kwh
from irtwin.report.plant.sheet import Sheet
from irtwin.report.questions import Answers, Row


@dataclass(frozen=True)
class Action:
    """A row of `actions.rq`, and how many others were done at the robot on that day."""

    row: Row
    others: int

    @property
    def state(self) -> str:
        """What is known of it, in words."""
        if not self.row["done_on"]:
            return "proposed"
        return f"done, {self.row['result'] or 'not verified yet'}"


def actions(answers: Answers, asked: Selection = ALL) -> tuple[Action, ...]:
    """Return what `actions.rq` answers of those `robots.rq` that are asked for.

    Proposals come first, the greatest saving a year before all; then what was done, the newest first.
    """
    rows = answers["actions"].rows
    days = Counter((row["robot"], row["done_on"]) for row in rows if row["done_on"])
    robots = {robot["robot"] for robot in answers["robots"].rows if asked.finds(robot)}
    found = [Action(row, max(days[row["robot"], row["done_on"]] - 1, 0)) for row in rows if row["robot"] in robots]
    found.sort(key=lambda one: (-(one.row["year_j"] or 0.0), one.row["name"], one.row["what"]))
    found.sort(key=lambda one: one.row["done_on"] or "~", reverse=True)
    return tuple(found)


def actions_sheet(found: tuple[Action, ...]) -> Sheet:
    """Return the actions as a table."""
    columns = (
        "robot", "action", "place", "state", "done_on", "by", "saving_a_year_kWh", "saving_a_run_kWh", "runs_before",
        "runs_after", "compared_for_each", "baseline_adjusted_kWh", "saved_kWh", "lower_kWh", "upper_kWh", "iri",
    )  # fmt: skip
    return Sheet(columns, [_cells(one) for one in found])


def _cells(one: Action) -> tuple[str | int | float | None, ...]:
    row = one.row
    said = (row["name"], row["what"], row["place"], one.state, row["done_on"], row["by"], kwh(row["year_j"]))
    energies = (kwh(row[name]) for name in ("adjusted_j", "saved_j", "lower_j", "upper_j"))
    return *said, kwh(row["run_j"]), row["before"], row["after"], row["unit"], *energies, row["action"]
