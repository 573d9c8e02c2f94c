from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests import gap_cases
from tests.synthetic import arm, as_run, data_set, measure, swing, truth

from irtwin.effects.catalogue import BASELINE
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.conditioning import condition
from irtwin.twin.identify import identify
from sham import circular_blocks, sham
from withheld import Adopted, Answer, Robot, page, where_it_matters

ROBOT = arm(2)


def logged(added=None, count=4):
    """Torque of an arm with friction, and noise that remembers 0.1 s."""
    runs = []
    for seed in range(count):
        motion = swing(ROBOT, seed, seconds=10.0)
        shown = measure(ROBOT, motion, seed=seed)
        white = np.random.default_rng(seed).standard_normal((len(motion.time) + 9, 2))
        noise = np.stack([np.convolve(column, np.ones(10) / 10, "valid") for column in white.T], axis=1)
        extra = 0.0 if added is None else added(motion)
        runs.append(as_run(replace(shown, torque=shown.torque + noise + extra, current=None, power=None)))
    return data_set(ROBOT, runs)


def fitted(logs):
    return identify(ROBOT, [condition(run, ROBOT) for run in logs.runs], BASELINE)


def test_blocks_follow_on_and_close_the_circle():
    place = circular_blocks(1000, 50, np.random.default_rng(0))
    assert len(place) == 1000
    steps = np.diff(place) % 1000
    assert (steps == 1).sum() >= 1000 - 20
    assert len(set(place.tolist())) > 300


@pytest.mark.nightly
@pytest.mark.slow
def test_a_sham_keeps_what_noise_remembers_and_loses_what_is_missing():
    sticks = logged(lambda motion: 6 * np.sign(motion.dq) * np.exp(-np.abs(motion.dq) / 0.1))
    full = fitted(sticks)
    nothing_missing = sham(sticks, full, full, seed=1)
    assert nothing_missing.effects == full.effect_ids
    for run, before in zip(nothing_missing.runs, sticks.runs, strict=True):
        motion = condition(before, ROBOT, full.cutoff)
        left, right = run.signals.torque - full.torque(motion), before.signals.torque - full.torque(motion)
        assert np.std(left) == pytest.approx(np.std(right), rel=0.3)
        assert np.corrcoef(left[:-1, 0], left[1:, 0])[0, 1] == pytest.approx(
            np.corrcoef(right[:-1, 0], right[1:, 0])[0, 1], abs=0.1
        )
    assert [cause.effect for _, cause in diagnose(sticks).causes][:1] == ["stribeck_friction"]
    assert not diagnose(nothing_missing).causes


def test_a_centred_sham_has_no_mean_of_its_own():
    healthy = logged()
    full = fitted(healthy)
    for run, before in zip(sham(healthy, full, full, seed=2, centred=True).runs, healthy.runs, strict=True):
        left = run.signals.torque - full.torque(condition(before, ROBOT, full.cutoff))
        assert left.mean(axis=0) == pytest.approx([0.0, 0.0], abs=1e-9)


@pytest.mark.slow
def test_an_effect_matters_where_the_fit_gets_worse_without_it():
    dry = np.array([0.0, truth(ROBOT)["Fc"][1]])  # joint 2 without its friction
    assert where_it_matters(logged(), "coulomb_friction") == ("joint_1", "joint_2")
    assert where_it_matters(logged(lambda m: -dry * np.sign(m.dq)), "coulomb_friction") == ("joint_1",)
    assert where_it_matters(logged(), "standby_power") == ()
    assert "joint_1" not in where_it_matters(logged(), "rotor_inertia")  # its link's inertia says the same
    assert where_it_matters(logged(), "coulomb_friction", fitted(logged()).effects) == ("joint_1", "joint_2")


def test_the_place_of_an_effect():
    answer = Answer(gap_cases.diagnosis("ambiguous"), 1.0)
    assert answer.named == ["stribeck_friction", "nonlinear_viscous_friction"]
    assert answer.place("nonlinear_viscous_friction") == 2
    assert answer.place_among_new("nonlinear_viscous_friction", ["stribeck_friction"]) == 1
    assert answer.place("backlash") is None and answer.place_among_new("backlash", []) is None


def test_the_page_says_what_came_first_what_was_missed_and_how_often_shams_are_blamed():
    shown = Answer(gap_cases.diagnosis("attributed"), 2.0)
    robot = Robot(
        "ur10",
        tuple(gap_cases.JOINTS),
        Answer(gap_cases.diagnosis("no_gap"), 1.0),
        {"viscous_friction": shown, "coulomb_friction": shown},
        {"viscous_friction": ("joint_a3", "joint_a4"), "coulomb_friction": ("joint_a1",)},
        Adopted(
            Answer(gap_cases.diagnosis("no_gap"), 1.0),
            {"viscous_friction": shown, "coulomb_friction": shown},
            {"viscous_friction": ("joint_a3",), "coulomb_friction": ("joint_a1",)},
        ),
        {"default twin": [[], ["payload"], []]},
    )
    text = page([robot], ["ur3_power"], "python bench/withheld.py DATA_FOLDER")
    assert "Of 2 effects withheld, the one withheld is the first cause in 1" in text
    assert "| ur10 | viscous_friction | attributed | cause 1 | cause 1 | 1 of 2 | joint_a4 | - | 0.70 | none |" in text
    assert "| ur10 | coulomb_friction | attributed | not named |" in text
    assert "| the default twin | 1 of 2 | 2 of 2 | 0 of 2 |" in text
    assert "| the adopted twin | 1 of 2 | 2 of 2 | 1 of 2 |" in text
    assert "| ur10 | viscous_friction | cause 1 | viscous_friction (friction) | 1 of 2 | cause 1 |" in text
    assert "with the adopted twin as it is: ur10 no_gap." in text
    assert "| ur10 | default twin | 3 | 1 (33 %) | 6 to 79 % | payload 1 |" in text
    assert "not run yet: ur3_power" in text
