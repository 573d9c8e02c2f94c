"""Candidate columns, part by part: what each effect gives over the whole run, where it acts."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, swing

from irtwin.effects.catalogue import catalogue
from irtwin.effects.compliance import Backlash, transmitted
from irtwin.effects.effect import Predicted
from irtwin.gap.regression.candidate_columns import Candidates, candidate_pattern
from irtwin.gap.regression.hypotheses import candidate_columns

ROBOT = arm(4)
MOTION = swing(ROBOT, 1, seconds=8.0)
MOTION = replace(MOTION, temperature=25 + 2 * MOTION.time[:, None] * np.ones(4))
RNG = np.random.default_rng(0)
TORQUE = 30 * np.sin(MOTION.time[:, None] + RNG.uniform(0, 6, 4))
BELOW = Predicted(TORQUE, 100 + 50 * np.sin(MOTION.time), 80 * np.sin(2 * MOTION.time))


def effects(signal):
    return [
        shape
        for effect in catalogue().values()
        if effect.signal == signal and effect.id != "rigid_body"
        for shape in effect.candidates(ROBOT)
    ]


@pytest.mark.slow
@pytest.mark.parametrize("effect", effects("torque"), ids=lambda effect: f"{effect.id}{list(effect.shape.values())}")
def test_parts_join_to_the_whole_where_the_effect_acts(effect, monkeypatch):
    monkeypatch.setattr(
        "irtwin.gap.regression.candidate_columns._PIECE", 250
    )  # so that it does not reach from one end to the other
    columns = candidate_columns(ROBOT, [effect])
    pattern = candidate_pattern(ROBOT, [effect], columns)
    candidates = Candidates(ROBOT, [effect], pattern, lambda whole: BELOW)
    parts = [candidates.part(piece) for piece in MOTION.pieces(93)]
    whole = effect.columns(ROBOT, MOTION, BELOW)
    assert not whole[:, ~pattern].any()
    for joint, used in enumerate(pattern):
        joined = np.concatenate([part[joint] for part in parts])
        np.testing.assert_allclose(joined, whole[:, joint, used], rtol=1e-9, atol=1e-9)


def test_parts_of_power_join_to_the_whole():
    tried = effects("power")
    columns = candidate_columns(ROBOT, tried)
    candidates = Candidates(ROBOT, tried, np.ones((1, len(columns)), dtype=bool), lambda whole: BELOW)
    joined = np.concatenate([candidates.part(piece)[0] for piece in MOTION.pieces(93)])
    place = 0
    for effect in tried:
        whole = effect.columns(ROBOT, MOTION, BELOW)
        if effect.id == "mechanical_power":  # nothing of it is free: one column, the sum over joints
            whole = whole.sum(axis=1, keepdims=True)
        np.testing.assert_allclose(joined[:, place : place + whole.shape[1]], whole, rtol=1e-9, atol=1e-9)
        place += whole.shape[1]
    assert place == joined.shape[1] == len(columns)


@pytest.mark.slow
def test_one_run_is_held_at_a_time():
    asked = []

    def below(whole):
        asked.append(whole.run)
        return BELOW

    tried = effects("torque")
    candidates = Candidates(ROBOT, tried, candidate_pattern(ROBOT, tried, candidate_columns(ROBOT, tried)), below)
    other = replace(MOTION, run="other")
    for motion in (MOTION, other):
        for piece in motion.pieces(400):
            candidates.part(piece)
    assert asked == [MOTION.run, "other"]


def test_gaps_are_moved_once_in_each_piece_of_a_run(monkeypatch):
    moved = []

    def counted(*given, **named):
        moved.append(given)
        return transmitted(*given, **named)

    monkeypatch.setattr("irtwin.gap.regression.candidate_columns._PIECE", 250)
    monkeypatch.setattr("irtwin.effects.compliance.transmitted", counted)
    plays = [play for play in Backlash().candidates(ROBOT) if play.about]
    tried = candidate_pattern(ROBOT, plays, candidate_columns(ROBOT, plays))
    candidates, moved[:] = Candidates(ROBOT, plays, tried, lambda whole: replace(BELOW, kept={})), []
    for piece in MOTION.pieces(93):
        candidates.part(piece)
    pieces = -(-len(MOTION.time) // 250)
    assert len(plays) > 2 and len(moved) <= 2 * (pieces + 1)  # with all of the inertia in the link, and with a part
