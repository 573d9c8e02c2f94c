"""Facts that users assert: rows follow them, the twin is fitted anew, and a data set that changed since is believed."""

from __future__ import annotations

from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import pytest
from tests import rows

from irtwin.storage.asserted import AssertedFact, follow
from irtwin.storage.database import Workspace
from irtwin.storage.schema import RunRow

WORK = f"{rows.ROBOT}.work"
SAID_TWICE = "payload_kg of {}: 6.0, as anna said on 2026-12-26; the data set says 0.0"
LATER = rows.NOON + timedelta(days=300)


def fact(value: str | None, replaced: str | None, time: datetime = LATER, **changes: Any) -> AssertedFact:
    said: dict[str, Any] = {
        **{"fact_id": f"{value}", "about_robot": rows.ROBOT, "subject": f"https://e/run/{WORK}", "predicate": "urn:kg"},
        **{"value": value, "replaced": replaced, "kind": "urn:double", "graph": "urn:g", "author": "anna"},
        **{"time": time, "place": "run.payload_kg", "row_key": f'{{"run_id": "{WORK}"}}'},
    }
    return AssertedFact(**said | changes)


@pytest.mark.parametrize(
    ("payload", "facts", "now", "words"),
    [
        (0.0, [("5.5", "0.0")], 5.5, "payload_kg of {}: 5.5, as anna said on 2026-12-26; the data set says 0.0"),
        (0.0, [("5.5", "0.0"), ("6.0", "5.5")], 6.0, SAID_TWICE),
        (7.0, [("5.5", "0.0")], 7.0, "payload_kg of {}: the data set says 7.0 now; what anna said"),
        (5.5, [("5.5", "0.0")], 5.5, None),
    ],
)
def test_a_data_set_follows_facts_unless_it_came_to_say_something_else(
    payload: float, facts: list[tuple[str, str]], now: float, words: str | None
) -> None:
    run = rows.run("work", payload_kg=payload)
    said = follow([run], [fact(*one) for one in facts])
    assert run.payload_kg == now
    assert [line[: len(words.format(WORK))] for line in said] == [words.format(WORK)] if words else said == []


def test_a_kept_fact_changes_its_row_and_makes_the_data_set_one_to_fit_anew(tmp_path: Path) -> None:
    robot, parts, runs, series = rows.data_set()
    with Workspace(tmp_path) as place:
        place.ingest(robot, parts, runs, series)
        rows.identify(place, f"{rows.ROBOT}.t")
        before = next(run for run in runs if run.run_id == WORK).payload_kg
        place.keep_facts([fact("5.5", str(before))], [])
        assert place.row(RunRow, WORK).payload_kg == 5.5
        for outcome in ("replaced", "unchanged"):
            robot, parts, runs, series = rows.data_set()
            facts = place.facts_about(rows.ROBOT)
            follow([robot, *parts, *runs], facts)
            assert place.ingest(robot, parts, runs, series, facts=facts) == outcome
        place.keep_facts([], ["5.5"])
        assert place.facts_about(rows.ROBOT) == []
        place.keep_facts([fact("5.5", "0.0")], [])
        place.drop_robot(rows.ROBOT)
        assert place.facts_about(rows.ROBOT) == []
