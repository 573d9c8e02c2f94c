"""The noise floor beside causes: what acts in one run and not in its repeat is no noise."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, swing

from irtwin.gap.data.case import Case
from irtwin.gap.data.noise_floor import noise_floor
from irtwin.gap.isolation.explained import Explained as ExplainedPower
from irtwin.gap.isolation.explained import ExplainedTorque, floor_left
from irtwin.gap.thresholds import DEFAULT

ROBOT = arm(1)
NOISE, LOAD = 0.3, 5.0


@pytest.fixture(scope="module")
def case():
    """A motion and its repeat, in which a load acts that takes torque and, times two, power."""
    motions, runs = {}, []
    for k in range(2):
        generator = np.random.default_rng(k)
        motion = replace(swing(ROBOT, 0, seconds=10.0), run=f"run_{k}")
        torque = NOISE * generator.standard_normal(motion.q.shape) + k * LOAD * np.sin(motion.q)
        power = NOISE * generator.standard_normal(len(motion.time)) + 2 * k * LOAD * np.sin(motion.q[:, 0])
        motions[motion.run] = replace(motion, torque=torque, power=power)
        runs.append(replace(as_run(motions[motion.run]), repeat_of="run_0" if k else None))
    return Case(ROBOT, (), tuple(runs), motions, (ROBOT, motions), DEFAULT)


class Explained(ExplainedTorque):
    """A cause that adds the load to the second run."""

    def __init__(self):
        self.finding = SimpleNamespace(causes=("load",))

    def added(self, cause, motion, *, real=False):
        return LOAD * np.sin(motion.q) * (motion.run == "run_1")

    def __call__(self, motion):
        return self.added("load", motion)


def test_what_a_cause_adds_to_one_of_two_repeats_is_taken_off(case):
    floor = noise_floor(case.runs, case.motions, DEFAULT.data)
    assert floor.torque[0] > 1 and floor.power > 2
    left = floor_left(case, floor, Explained(), lambda motion, torque: (2 * torque[:, 0], torque[:, 0]))
    assert left.torque[0] == pytest.approx(NOISE, rel=0.2)
    assert left.power == pytest.approx(NOISE, rel=0.2)


class OfPower(ExplainedPower):
    """A cause of power alone, in the second run."""

    def __init__(self):
        self.finding = SimpleNamespace(causes=("brakes",))

    def added(self, cause, motion, *, real=False):
        return 2 * LOAD * np.sin(motion.q[:, 0]) * (motion.run == "run_1")


def test_what_a_cause_of_power_adds_to_one_of_two_repeats_is_taken_off(case):
    floor = noise_floor(case.runs, case.motions, DEFAULT.data)
    left = floor_left(case, floor, OfPower())
    assert left.power == pytest.approx(NOISE, rel=0.2)
    assert left.torque[0] == floor.torque[0]


def test_power_that_nobody_measured_keeps_its_floor(case):
    floor = noise_floor(case.runs, case.motions, DEFAULT.data)
    left = floor_left(case, floor, Explained(), None)
    assert left.power == floor.power and left.torque[0] < floor.torque[0]


def test_a_floor_is_never_raised(case):
    low = replace(noise_floor(case.runs, case.motions, DEFAULT.data), torque=np.array([0.1]), power=0.1)
    left = floor_left(case, low, Explained(), lambda motion, torque: (2 * torque[:, 0], torque[:, 0]))
    assert (left.torque[0], left.power) == (0.1, 0.1)


def test_a_floor_from_above_the_band_stays(case):
    floor = replace(noise_floor(case.runs, case.motions, DEFAULT.data), source="out_of_band")
    assert floor_left(case, floor, Explained(), None) is floor
