"""What is proposed to save energy, what of it was done, and what that saved by the runs before and after."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass

from irtwin.report.plant.choice import ALL, Selection
from irtwin.report.plant.energies import kwh
from irtwin.report.plant.sheet import Sheet
from irtwin.report.plant.verification import Verification, verification
from irtwin.report.questions import Answers, Row


@dataclass(frozen=True)
class Action:
    """A row of `actions.rq`; once it is done with what it saved, and how many others the robot had on that day."""

    row: Row
    saved: Verification | None
    others: int

    @property
    def state(self) -> str:
        """What is known of it, in words."""
        return "proposed" if self.saved is None else f"done, {self.saved.words}"


def actions(answers: Answers, asked: Selection = ALL) -> tuple[Action, ...]:
    """Return what `actions.rq` and `before_and_after.rq` answer of those `robots.rq` that are asked for.

    Proposals come first, the greatest saving a year before all; then what was done, the newest first.
    """
    runs: dict[str, list[Row]] = defaultdict(list)
    for run in answers["before_and_after"].rows:
        runs[run["robot"]].append(run)
    rows = answers["actions"].rows
    days: dict[str, list[str]] = defaultdict(list)
    for row in rows:
        if row["done_on"]:
            days[row["robot"]].append(row["done_on"])
    robots = {robot["robot"] for robot in answers["robots"].rows if asked.finds(robot)}
    found = [_action(row, runs[row["robot"]], days[row["robot"]]) for row in rows if row["robot"] in robots]
    found.sort(key=lambda one: (-(one.row["year_j"] or 0.0), one.row["name"], one.row["what"]))
    found.sort(key=lambda one: one.row["done_on"] or "~", reverse=True)
    return tuple(found)


def _action(row: Row, runs: list[Row], days: list[str]) -> Action:
    on = row["done_on"]
    if not on:
        return Action(row, None, 0)
    before = max((day for day in days if day < on), default="")
    until = min((day for day in days if day > on), default="~")
    return Action(row, verification(runs, on, before, until), days.count(on) - 1)


def actions_sheet(found: tuple[Action, ...]) -> Sheet:
    """Return the actions as a table."""
    columns = (
        "robot", "action", "place", "state", "done_on", "by", "saving_a_year_kWh", "saving_a_run_kWh", "runs_before",
        "runs_after", "compared_for_each", "baseline_adjusted_kWh", "saved_kWh", "lower_kWh", "upper_kWh", "iri",
    )  # fmt: skip
    return Sheet(columns, [_cells(one) for one in found])


def _cells(one: Action) -> tuple[str | int | float | None, ...]:
    row, saved = one.row, one.saved
    said = (row["name"], row["what"], row["place"], one.state, row["done_on"], row["by"], kwh(row["year_j"]))
    verified: tuple[str | int | float | None, ...] = (None,) * 7
    if saved is not None:
        verified = (saved.before, saved.after, *(None,) * 5)
        if saved.adjusted_j is not None:
            energies = (saved.adjusted_j, saved.saved_j, saved.lower_j, saved.upper_j)
            verified = (saved.before, saved.after, saved.unit, *map(kwh, energies))
    return *said, kwh(row["run_j"]), *verified, row["action"]
