"""The list of what is to be done to save: its order, its states, the runs between two changes, its table."""

from __future__ import annotations

from typing import Any, cast

import pytest
from pyoxigraph import QuerySolutions, RdfFormat, Store
from tests import plants

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import ID, IRT
from irtwin.report.plant import overview, page
from irtwin.report.plant.actions import actions, actions_sheet
from irtwin.report.plant.choice import Selection
from irtwin.report.questions import Answer, Answers, PageQuestion, ask


def answered(rows: dict[str, list[dict[str, Any]]]) -> Answers:
    return {name: Answer(PageQuestion(name, "", (), ""), tuple(of)) for name, of in rows.items()}


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


def test_proposals_come_first_and_the_greatest_of_them() -> None:
    found = actions(ANSWERS)
    assert [one["what"] for one in found] == ["large", "small", "second", "done", "first"]
    assert [one["name"] for one in actions(ANSWERS, Selection(find="b"))] == ["B", "B"]


def test_two_changes_of_one_day_are_told_together() -> None:
    store = Store()
    done = {"A": ("one", "two"), "B": ("one",)}
    told = "".join(
        f'id:{robot}_{what} a irt:Saving_Action ; irt:saves_at id:{robot} ; irt:Done_On "2026-03-01" .'
        for robot, some in done.items()
        for what in some
    )
    names = "".join(f'id:{robot} irt:has_Information [ irt:IR_Name "{robot}" ] .' for robot in done)
    prefixes = f"@prefix irt: <{IRT}> . @prefix id: <{ID}> ."
    store.load(f"{prefixes} {told} {names} id:A_three a irt:Saving_Action ; irt:saves_at id:A .", RdfFormat.TURTLE)
    rows = cast(QuerySolutions, store.query(page.questions()["actions"].text))
    said = [(row["action"].value.removeprefix(ID), row["state"].value, row["others"]) for row in rows]
    assert [(name, state, None if others is None else int(others.value)) for name, state, others in sorted(said)] == [
        ("A_one", "done, not verified yet", 1),
        ("A_three", "proposed", None),
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
    html = page.render(
        "page.html.jinja",
        answers,
        {},
        found=found,
        reports=[],
        actions=actions(answers),
        file="",
        excel=True,
        trouble="",
    )
    assert "What to do to save" in html and ">switch off while waiting</a>" in html
    assert ">check the gear oil and temperature</a><small>j1</small>" in html
    assert '<form action="/saving"' not in html and "with a token for updates" in html
    assert plants.HOSTILE not in html
