"""The list of what is to be done to save: its order, its states, the runs between two changes, its table."""

from __future__ import annotations

from typing import Any, cast

import pytest
from pyoxigraph import QuerySolutions, RdfFormat, Store
from tests import plants
from tests.report.robots import answered

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID, IRT
from irtwin.report.plant import overview, page
from irtwin.report.plant.choice import Selection
from irtwin.report.plant.overview import actions, actions_sheet
from irtwin.report.questions import ask


def action(robot: str, what: str, done_on: str | None = None, year_j: float | None = None) -> dict[str, Any]:
    said: dict[str, Any] = {"state": "", "others": None}
    said |= {"action": f"id:{robot}/{what}", "robot": robot, "name": robot, "what": what, "place": "", "advice": None}
    found = dict.fromkeys(("result", "before", "after", "unit", "adjusted_j", "saved_j", "lower_j", "upper_j"))
    return {**said, **found, "year_j": year_j, "run_j": None, "done_on": done_on, "by": "anna" if done_on else None}


VERIFIED = {
    "state": "done, verified", "result": "verified", "before": 3, "after": 3, "unit": "hour", "adjusted_j": 270.0,
    "saved_j": 90.0, "lower_j": 80.0, "upper_j": 100.0,
}  # fmt: skip


ROBOT = {"cell": None, "line": None, "type": None, "manufacturer": None}
ANSWERS = answered(
    {
        "robots": [{"robot": name, "name": name, **ROBOT} for name in ("A", "B")],
        "actions": [
            action("A", "small", year_j=1.0),
            {**action("A", "first", "2026-02-01"), "result": "too few runs", "before": 1, "after": 0},
            action("A", "second", "2026-03-01") | VERIFIED,
            action("B", "large", year_j=5.0),
            action("B", "done", "2026-02-20"),
        ],
    }
)


def test_actions_are_of_the_robots_that_are_asked_for() -> None:
    assert [one["name"] for one in actions(ANSWERS, Selection(find="b"))] == ["B", "B"]


def test_proposals_come_first_and_changes_of_one_day_are_told_together() -> None:
    store = Store()
    done = {"A": {"one": 1, "two": 1}, "B": {"one": 1, "later": 2}}
    told = "".join(
        f'id:{robot}_{what} a irt:Saving_Action ; irt:saves_at id:{robot} ; irt:Done_On "2026-03-0{day}" .'
        for robot, some in done.items()
        for what, day in some.items()
    )
    names = "".join(f'id:{robot} irt:has_Information [ irt:IR_Name "{robot}" ] .' for robot in done)
    prefixes = f"@prefix irt: <{IRT}> . @prefix id: <{ID}> ."
    proposed = " ".join(
        f"id:A_{what} a irt:Saving_Action ; irt:saves_at id:A ; irt:called_for_by [ irt:Yearly_Saving {year}.0e0 ] ."
        for what, year in (("small", 1), ("large", 5))
    )
    store.load(f"{prefixes} {told} {names} {proposed}", RdfFormat.TURTLE)
    rows = cast(QuerySolutions, store.query(page.questions()["actions"].text))
    said = [(row["action"].value.removeprefix(ID), row["state"].value, row["others"]) for row in rows]
    assert [(name, state, None if others is None else int(others.value)) for name, state, others in said] == [
        ("A_large", "proposed", None),
        ("A_small", "proposed", None),
        ("B_later", "done, not verified yet", 0),
        ("A_one", "done, not verified yet", 1),
        ("A_two", "done, not verified yet", 1),
        ("B_one", "done, not verified yet", 0),
    ]


def test_the_table_says_energies_in_kwh() -> None:
    sheet = actions_sheet(actions(ANSWERS))
    (second,) = [dict(zip(sheet.columns, row, strict=True)) for row in sheet.rows if row[1] == "second"]
    assert (second["state"], second["by"], second["compared_for_each"]) == ("done, verified", "anna", "hour")
    assert second["saved_kWh"] == pytest.approx(90.0 / 3.6e6)
    assert {len(row) for row in sheet.rows} == {len(sheet.columns)}


def test_a_page_lists_what_the_graph_proposes(plant: KnowledgeGraph) -> None:
    answers = ask(plant, page.questions(), {})
    found = overview.overview(answers)
    said = {"found": found, "reports": [], "actions": actions(answers), "file": "", "excel": True, "trouble": ""}
    html = page.render("page.html.jinja", answers, {}, **said)
    assert "What to do to save" in html and ">switch off while waiting</a>" in html
    assert ">check the gear oil and temperature</a><small>j1</small>" in html
    assert '<form action="/saving"' not in html and "with a token for updates" in html
    assert plants.HOSTILE not in html
