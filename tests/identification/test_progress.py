from __future__ import annotations

import numpy as np
from tests.synthetic import arm, swing

from irtwin.identification import progress
from irtwin.identification.accumulate import Rows
from irtwin.identification.progress import Told, paced, with_progress

ROBOT = arm(2)
MOTIONS = [swing(ROBOT, seed, seconds=4.0) for seed in (1, 2)]


def equations(motion):
    return Rows(np.ones((len(motion.time), 1, 1)), np.zeros((len(motion.time), 1)), motion.q[:, :1])


def said(motions, every, monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", every)
    lines = []
    asked = with_progress(equations, motions, lines.append)
    for motion in motions:
        for piece in motion.pieces(100):
            np.testing.assert_array_equal(asked(piece).measured, piece.q[:, :1])
    return lines


def test_long_work_says_how_far_it_has_come(monkeypatch):
    lines = said(MOTIONS, 0.0, monkeypatch)
    assert lines[1] == "  run 1 of 2, 25 % of it"
    assert lines[-1] == "  run 2 of 2, 75 % of it"


def test_short_work_says_nothing(monkeypatch):
    assert said(MOTIONS, 60.0, monkeypatch) == []
    assert with_progress(equations, MOTIONS, None) is equations


def test_steps_are_told_where_they_take_long(monkeypatch):
    lines = []
    paced(lines.append)("a step at once")
    assert lines == []
    monkeypatch.setattr(progress, "_EVERY", 0.0)
    paced(lines.append)("a step")
    paced(None)("nobody listens")
    assert lines == ["a step"]


def test_all_that_is_paced_by_one_keeps_its_clock(monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", 5.0)
    now, lines = [0.0], []
    monkeypatch.setattr(progress.time, "monotonic", lambda: now[0])
    told = Told(lines.append)
    first, second = paced(told), paced(paced(told))
    for seconds, tell, line in ((3, first, "too soon"), (5, second, "a"), (9, first, "too soon"), (10, first, "b")):
        now[0] = float(seconds)
        tell(line)
    now[0] = 11.0
    told("at once")
    now[0] = 15.0
    second("too soon")
    assert lines == ["a", "b", "at once"]
