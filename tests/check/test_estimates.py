"""A delay, a scale and a zero put into logs of known robots are found as such numbers; what no motion shows is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.check.test_check import exchanged, found, healthy, late, one, spoilt
from tests.synthetic import arm, as_run, measure, swing

from irtwin.check.check import check
from irtwin.check.estimates import Lateness, estimate_findings
from irtwin.check.moving import moving
from irtwin.signals.channels import Signals
from irtwin.signals.finding import LogFinding
from irtwin.signals.log import DataSet

ROBOT = arm(4)


def said(data_set: DataSet) -> list[LogFinding]:
    return estimate_findings(ROBOT, moving(data_set))


@pytest.mark.parametrize(
    ("field", "joint", "change", "fault", "channel", "key", "truth"),
    [
        ("torque", 1, late, "delay", "tau_joint_2", "delay_ms", 20.0),
        ("torque", 2, lambda values: 2 * values, "scale", "tau_joint_3", "ratio", 2.0),
    ],
)
def test_the_number_of_a_fault(
    field: str, joint: int, change: Callable[[np.ndarray], np.ndarray], fault: str, channel: str, key: str, truth: float
):
    (finding,) = said(spoilt(healthy(), one(field, joint, change)))
    assert (finding.fault, finding.channel) == (fault, channel)
    assert finding.evidence[key] == pytest.approx(truth, rel=0.1)
    assert not finding.stops


@pytest.mark.slow
def test_a_zero_that_is_off():
    robot = arm(6)
    motion = measure(robot, swing(robot, 0), noise=0.05)
    log = DataSet(Path("set"), robot, (as_run(motion, current=None),), None, None, "mains", False, {})
    (finding,) = estimate_findings(robot, moving(spoilt(log, one("q", 1, lambda values: values + 0.1))))
    assert (finding.fault, finding.channel) == ("zero_offset", "q_joint_2")
    assert finding.evidence["offset_rad"] == pytest.approx(0.1, abs=0.003)
    assert estimate_findings(robot, moving(log)) == []


def test_a_zero_that_no_torque_shows_is_not_guessed():
    for joint in (0, 3):  # about a vertical axis; the last one
        assert said(spoilt(healthy(), one("q", joint, lambda values: values + 0.3))) == []


def test_another_payload_is_no_fault():
    heavy = swing(ROBOT, 5)
    motion = measure(ROBOT, heavy, noise=0.3, seed=5)
    lever = np.where(np.arange(4) == 1, 30 * np.cos(heavy.q[:, [1]]), 0.0)
    loaded = replace(as_run(motion, torque=motion.torque + lever), payload_mass=8.0)
    data_set = healthy()
    assert check(replace(data_set, runs=(*data_set.runs, loaded))).findings == ()


@pytest.mark.slow
def test_two_reversed_torques_are_both_mended():
    faulty = spoilt(spoilt(healthy(), one("torque", 1, np.negative)), one("torque", 3, np.negative))
    assert found(faulty) == {("sign", "tau_joint_2"), ("sign", "tau_joint_4")}
    for run, known in zip(check(faulty).data_set.runs, healthy().runs, strict=True):
        np.testing.assert_array_equal(run.signals.torque, known.signals.torque)


def test_exchanged_speeds_of_nearly_opposite_motions_are_not_called_reversed():
    def nearly_opposite(signals: Signals) -> Signals:
        q, dq = np.array(signals.q), np.array(signals.dq)
        q[:, 2], dq[:, 2] = 0.2 * q[:, 2] - q[:, 1], 0.2 * dq[:, 2] - dq[:, 1]
        return replace(signals, q=q, dq=dq, torque=None)

    faulty = spoilt(spoilt(healthy(), nearly_opposite), exchanged(1, 2, "dq"))
    assert found(faulty) == {("swap", "dq_joint_2 <-> dq_joint_3")}


ON_TIME = [(0.001, 0.002), (0.003, 0.002), (0.002, 0.001)]  # s, of the friction of other joints


def test_friction_tells_a_delay_where_that_of_other_joints_is_on_time():
    torque = Lateness(bodies=(0.01, 0.02), friction=(0.022, 0.002))
    delay, deviation = torque.beside(ON_TIME)
    assert delay == pytest.approx(0.02, abs=0.001)
    assert deviation < 0.004


def test_friction_that_looks_late_at_every_joint_is_no_delay():
    torque = Lateness(bodies=(0.0, 0.005), friction=(0.022, 0.002))
    assert abs(torque.beside([(late + 0.02, deviation) for late, deviation in ON_TIME])[0]) < 0.001


def test_too_few_other_joints_tell_nothing_of_friction():
    torque = Lateness(bodies=(0.001, 0.005), friction=(0.022, 0.002))
    assert torque.beside([*ON_TIME[:2], (0.002, 0.05)]) == torque.bodies


def test_a_torque_that_shows_no_delay_at_all():
    assert Lateness((0.0, np.inf), (0.0, np.inf)).beside(ON_TIME) == (0.0, np.inf)
