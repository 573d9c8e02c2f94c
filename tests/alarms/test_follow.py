"""Each alarm is told once when it begins and once when it is over, over restarts as well."""

from __future__ import annotations

import json
import threading
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import pytest

from irtwin.alarms import follow as following
from irtwin.alarms.alarm import Alarm, sparql_of_rules
from irtwin.alarms.follow import ToldAlarms, follow, told_in
from irtwin.errors import InputError
from irtwin.resources import shipped

GAP = Alarm("arm", "live_1", "gap_alarm", "2026-03-01T12:00:04+00:00", "torque", "j2", None, "active", "25 N m away")
OVER = replace(GAP, state="cleared", until="2026-03-01T12:00:12+00:00")
IDLE = Alarm("arm", "live_1", "idle_alarm", "2026-03-01T12:10:00+00:00", None, None, None, "active", "stands still")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    return tmp_path / "told.json"


def told(file: Path, *looks: Sequence[Alarm]) -> list[list[tuple[str, Alarm]]]:
    told = ToldAlarms(file)
    return [list(told.news(found)) for found in looks]


def test_once_per_onset_and_once_at_its_end(file: Path) -> None:
    looks = [], [GAP], [GAP], [GAP, IDLE], [OVER], [OVER]
    raised, cleared = [("raised", GAP)], [("cleared", OVER), ("cleared", IDLE)]
    assert told(file, *looks) == [[], raised, [], [("raised", IDLE)], cleared, []]


def test_a_reason_that_grows_is_no_news(file: Path) -> None:
    assert told(file, [GAP], [replace(GAP, reason="30 N m away")]) == [[("raised", GAP)], []]


def test_an_alarm_that_comes_and_goes_between_two_looks_is_told(file: Path) -> None:
    assert told(file, [], [OVER]) == [[], [("raised", OVER), ("cleared", OVER)]]


def test_the_same_cause_later_is_another_alarm(file: Path) -> None:
    again = replace(IDLE, since="2026-03-01T13:00:00+00:00")
    assert told(file, [IDLE], [], [again])[-1] == [("raised", again)]


def test_a_first_look_tells_what_is_active_and_leaves_what_is_over(file: Path) -> None:
    assert told(file, [OVER, IDLE]) == [[("raised", IDLE)]]


def test_a_restart_tells_nothing_again_and_what_came_meanwhile(file: Path) -> None:
    assert told(file, [GAP]) == [[("raised", GAP)]]
    assert told(file, [GAP, IDLE]) == [[("raised", IDLE)]]
    assert told(file, [OVER]) == [[("cleared", OVER), ("cleared", IDLE)]]


def test_a_spoiled_file_is_said(file: Path) -> None:
    for spoiled in ("{", "[1]", '[{"robot": "arm"}]'):
        file.write_text(spoiled)
        with pytest.raises(InputError, match=r"told\.json: cannot be understood .*; delete it"):
            ToldAlarms(file)


def test_two_tellers_of_one_workspace_would_tell_by_halves(tmp_path: Path) -> None:
    with told_in(tmp_path), pytest.raises(InputError, match="another `irtwin alarms --follow`"), told_in(tmp_path):
        pass
    with told_in(tmp_path):
        pass


def test_a_line_says_what_why_and_by_which_query(file: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(following, "EVERY", 0.0)
    done, lines, said = threading.Event(), list[dict[str, str]](), list[str]()

    def look() -> list[Alarm]:
        looks.append(1)
        if len(looks) in (2, 3):
            raise InputError("busy")
        if len(looks) == 5:
            done.set()
        return [GAP] if len(looks) < 4 else [OVER]

    looks: list[int] = []
    sparql = sparql_of_rules(shipped())
    follow(look, ToldAlarms(file), lambda line: lines.append(json.loads(line)), done, said.append, sparql)
    raised, cleared = lines
    assert (raised["event"], raised["robot"], raised["joint"], raised["reason"]) == (
        "raised",
        "arm",
        "j2",
        "25 N m away",
    )
    assert raised["since"] == GAP.since and raised["until"] is None
    assert raised["sparql"].lstrip().startswith("PREFIX") and "irt:Gap_Alarm" in raised["sparql"]
    assert (cleared["event"], cleared["until"]) == ("cleared", OVER.until)
    assert said == ["alarms are not known now: busy"]
