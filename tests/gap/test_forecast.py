from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.synthetic import swing

import diagnosis_speed
from irtwin.effects.catalogue import BASELINE
from irtwin.gap.forecast import Forecast, forecast
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.channels import Signals
from irtwin.signals.log import DataSet, Run

RUNS = 12
# of `bench/diagnosis_speed.py` 12xSAMPLESxJOINTS, with power, by joints and samples
SECONDS = {(6, 1000): 9.3, (12, 1000): 45.2, (20, 1000): 69.6, (30, 1000): 255.6, (6, 5000): 22.9}  # of processor
BYTES = {(6, 1000): 684e6, (12, 1000): 1487e6, (20, 1000): 2313e6, (30, 1000): 4665e6, (6, 5000): 1087e6}


def data_set(joints: int, seconds: float = 10.0, *, power: bool = True) -> DataSet:
    robot = parse_urdf(diagnosis_speed.chain(joints))
    runs = []
    for k in range(RUNS):
        motion = swing(robot, k, seconds)
        warm = np.full_like(motion.q, 30.0)
        signals = Signals(motion.time, motion.q, torque=np.zeros_like(motion.q), temperature=warm)
        if power:
            signals = replace(signals, power=np.zeros(len(motion.time)))
        role, repeat = "reference" if k < RUNS // 3 else "observed", {1: "0", RUNS // 3 + 1: str(RUNS // 3)}.get(k)
        runs.append(Run(str(k), Path("run"), "", role, 0.0, (0.0, 0.0, 0.0), repeat, None, {}, signals))
    return DataSet(Path(), robot, tuple(runs), (*BASELINE, "copper_loss"), None, None, False, {})


def expected(joints: int, seconds: float = 10.0, *, power: bool = True) -> Forecast:
    return forecast(data_set(joints, seconds, power=power))


@pytest.mark.parametrize(("joints", "samples"), SECONDS)
def test_the_forecast_is_within_three_tenths_of_what_was_measured(joints, samples):
    found = expected(joints, samples / 100)
    assert SECONDS[joints, samples] / 1.3 <= found.seconds <= 1.3 * SECONDS[joints, samples]
    assert BYTES[joints, samples] / 1.3 <= found.memory <= 1.3 * BYTES[joints, samples]


def test_more_joints_take_more():
    found = [expected(joints) for joints in (3, 6, 9, 20, 40)]
    assert np.all(np.diff([one.seconds for one in found]) > 0)
    assert np.all(np.diff([one.memory for one in found]) > 0)


def test_longer_runs_and_power_take_more():
    assert expected(6, 20.0).seconds > expected(6).seconds > expected(6, power=False).seconds
    assert expected(6, 20.0).memory > expected(6).memory > expected(6, power=False).memory


@pytest.mark.parametrize(
    ("seconds", "line"),
    [
        (44.0, "30 joints, 12 runs: about 40 s of processor, more where much differs, and 1.7 GB"),
        (170.0, "30 joints, 12 runs: about 3 minutes of processor, more where much differs, and 1.7 GB"),
    ],
)
def test_it_is_said_in_words_where_it_is_long(seconds, line):
    found = Forecast(30, 12, seconds, 1.7e9)
    assert found.line == line
    assert found.long
    assert not Forecast(6, 12, 12.0, 0.4e9).long
