from __future__ import annotations

import numpy as np
from tests.synthetic import arm, swing

from irtwin.identification import progress
from irtwin.identification.accumulate import Rows, accumulate
from irtwin.identification.progress import tell, tell_step, telling, track

MOTIONS = [swing(arm(2), seed, seconds=4.0) for seed in (1, 2)]


def equations(motion):
    return Rows(np.ones((len(motion.time), 1, 1)), np.zeros((len(motion.time), 1)), motion.q[:, :1])


def said(every, monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", every)
    lines = []
    with telling(lines.append):
        accumulate(MOTIONS, equations, np.ones((1, 1), dtype=bool))
    return lines


def test_long_work_says_how_far_it_has_come(monkeypatch):
    assert said(0.0, monkeypatch) == [f"  reading run {number} of 2" for number in (1, 2)]


def test_what_is_done_and_what_is_left_is_told_where_both_are_known(monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", 0.0)
    lines = []
    with telling(lines.append):
        assert list(track("ab", "a letter")) == ["a", "b"]
        assert list(track(range(1), lambda number: f"number {number}")) == [0]
    assert lines == ["  a letter, 1 of 2", "  a letter, 2 of 2", "  number 0, 1 of 1"]


def test_short_work_says_nothing(monkeypatch):
    assert said(60.0, monkeypatch) == []


def test_steps_are_told_where_they_take_long(monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", 5.0)
    now, lines = [0.0], []
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    with telling(lines.append):
        for seconds, line in ((3, "too soon"), (5, "a"), (9, "too soon"), (10, "b")):
            now[0] = float(seconds)
            tell_step(line)
        now[0] = 11.0
        tell("at once")
        now[0] = 15.0
        with telling(None):  # who hears already goes on
            tell_step("too soon")
    tell("nobody listens")
    assert lines == ["a", "b", "at once"]
