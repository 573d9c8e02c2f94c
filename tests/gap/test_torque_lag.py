"""A lag of all joints' torque is one of filters and no cause; one of a single joint, or of any length more, is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.data_sets import write
from tests.synthetic import arm, as_run, measure, swing

from irtwin.document.document import Document
from irtwin.gap.data.case import Case
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.log import read_data_set
from irtwin.signals.motion import Motion

ROBOT = arm(3)


def diagnosed(folder: Path, lags: tuple[float, ...]) -> Document:
    """What is told of three runs in which the torque of each joint lags by so much, s."""
    runs = []
    for seed in (1, 2, 3):
        motion = measure(ROBOT, swing(ROBOT, seed, rate=250.0), noise=0.05, seed=seed)
        late = [np.interp(motion.time - lag, motion.time, one) for lag, one in zip(lags, motion.torque.T, strict=True)]
        runs.append(as_run(replace(motion, torque=np.array(late).T, current=None, power=None)))
    return diagnose(read_data_set(write(folder / "set", ROBOT, runs))).document


@pytest.mark.slow
def test_a_lag_of_all_joints_is_taken_out_and_said(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, (1.5e-3,) * 3)
    assert found.causes == ()
    assert "1.5 ms later than positions" in found.cutoff.why


@pytest.mark.slow
@pytest.mark.parametrize(
    ("lags", "joints"),
    [
        pytest.param((0.0, 4e-3, 0.0), {"joint_2"}, id="of one joint"),
        pytest.param(
            (20e-3,) * 3, {"joint_1", "joint_2", "joint_3"}, id="longer than filters make it", marks=pytest.mark.nightly
        ),
    ],
)
def test_another_delay_is_told(tmp_path: Path, lags: tuple[float, ...], joints: set[str]) -> None:
    found = diagnosed(tmp_path, lags)
    assert [(cause.effect, set(cause.joints)) for cause in found.causes] == [("time_delay", joints)]
    assert "later than positions" not in found.cutoff.why


def test_torque_comes_so_much_earlier_and_power_as_it_was() -> None:
    time = np.arange(0, 2, 1e-2)
    still = np.zeros((len(time), 1))
    late = np.sin(3 * (time - 4e-3))[:, None]
    motion = Motion(time, still, still, still, torque=late, run="a")
    case = Case(None, (), (), {"a": motion, "b": Motion(time, still, still, still, run="b")}, (None, {}), None)
    without = case.without_lag(4e-3).motions
    assert without["a"].torque[1:-1, 0] == pytest.approx(np.sin(3 * time)[1:-1], abs=1e-5)
    assert without["b"] is case.motions["b"]


def test_at_a_slow_rate_a_sample_is_no_lag_of_the_robot() -> None:
    still = np.zeros((50, 1))
    slow = Motion(np.arange(50) / 50.0, still, still, still, torque=still, run="a")
    assert Case(None, (), (), {"a": slow}, (None, {}), None).longest_lag == pytest.approx(20e-3)
