"""Payloads in some of the runs, which are known."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from tests.synthetic import arm, measure, swing

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.load import Payload
from irtwin.effects.stack import Stack
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.screening.payloads import untold_payload
from irtwin.identification import progress

ROBOT = arm(4)
LOAD = np.array([0.6, 0.0, 0.02, 0.05, 0, 0, 0, 0, 0, 0])


def search(loaded, observed=range(8)):
    motions = []
    for seed in range(8):
        motion = replace(swing(ROBOT, seed, seconds=6.0, rate=50.0), run=f"run_{seed}")
        shown = measure(ROBOT, motion, noise=0.5, seed=seed)
        extra = Payload().contribution(ROBOT, motion, LOAD) if seed in loaded else 0.0
        motions.append(replace(shown, torque=shown.torque + extra))
    grouping = Grouping({m.run: m.run for m in motions}, frozenset(f"run_{seed}" for seed in observed))
    system = torque_system(Stack(ROBOT, BASELINE), motions, grouping, (), None)
    return untold_payload(ROBOT, system, system.noise_before)


def test_the_runs_that_carry_a_payload_are_told_from_those_that_do_not():
    found = search((1, 4, 5))
    assert found.runs == ("run_1", "run_4", "run_5")


def test_the_search_says_how_far_it_has_come(monkeypatch):
    monkeypatch.setattr(progress, "_EVERY", 0.0)
    lines = []
    with progress.telling(lines.append):
        search((1, 4, 5))
    assert "  payloads in run_7, 8 of 8" in lines


def test_the_heavier_part_is_the_one_that_carries():
    assert search((0, 2, 3, 4, 6, 7)).runs == tuple(f"run_{seed}" for seed in (0, 2, 3, 4, 6, 7))


def test_one_run_cannot_be_parted():
    assert search((1,), observed=range(1)) is None
