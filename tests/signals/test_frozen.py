"""Stretches in which a channel froze are left out; what stands, creeps, is coarse or cut off is kept."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.data_sets import write
from tests.synthetic import arm, as_run, measure, swing

from irtwin.signals.channels import Signals
from irtwin.signals.log import Run, read_data_set
from irtwin.signals.sampling import as_sampled, frozen

ROBOT = arm(2)


@pytest.fixture(scope="module")
def run() -> Run:
    return as_run(measure(ROBOT, swing(ROBOT, 1, 20.0), noise=0.1))


def changed(run: Run, channel: str, joint: int, rows: slice, value: float | None = None) -> Signals:
    values = getattr(run.signals, channel).copy()
    values[rows, joint] = values[rows.start, joint] if value is None else value
    return replace(run.signals, **{channel: values})


@pytest.mark.parametrize("value", [None, 0.0], ids=["as it was", "zero"])
def test_torque_that_freezes_is_left_out_and_cuts_the_run(tmp_path, run, value):
    spoilt = replace(run, signals=changed(run, "torque", 1, slice(800, 900), value))
    data_set = read_data_set(write(tmp_path / "set", ROBOT, [spoilt]))
    assert [len(each.signals.time) for each in data_set.runs] == [pytest.approx(800, abs=1), 1100]
    lost, cut = data_set.findings
    assert (lost.fault, lost.channel, lost.mended) == ("frozen", "tau_joint_2", True)
    assert "tau_joint_2 froze from 8.0" in lost.say and "nothing was measured there; 10" in lost.say
    assert "taken as 2 runs" in cut.say


def test_a_few_frozen_samples_leave_one_run(tmp_path, run):
    fastest = int(np.argmax(np.abs(np.diff(run.signals.q[50:-50, 0])))) + 50
    spoilt = replace(run, signals=changed(run, "torque", 0, slice(fastest - 10, fastest + 10)))
    data_set = read_data_set(write(tmp_path / "set", ROBOT, [spoilt]))
    assert [len(each.signals.time) for each in data_set.runs] == [len(run.signals.time) - 20]


def test_a_position_that_stands_and_jumps_froze(run):
    ((column, rows),) = frozen(changed(run, "q", 0, slice(800, 840)), ROBOT.joint_names)
    assert (column, rows) == ("q_joint_1", slice(800, 840))


def test_a_plan_that_jumps_is_left_as_it_is(run):
    jumping = replace(changed(run, "q", 0, slice(800, 840)), torque=None, power=None)
    assert as_sampled(jumping, run.file) == ([jumping], [])
    pieces, _ = as_sampled(jumping, run.file, ROBOT.joint_names)
    assert len(pieces) == 2


def test_a_joint_that_stands_and_moves_on_did_not_freeze(run):
    time = run.signals.time
    stands = np.minimum(time, 8.0) + np.maximum(time - 10.0, 0.0)
    q = np.column_stack([np.interp(stands, time, q) for q in run.signals.q.T])
    assert not list(frozen(replace(run.signals, q=q), ROBOT.joint_names))


@pytest.mark.parametrize("step", [0.5, 4.0])
def test_a_coarse_torque_did_not_freeze(run, step):
    assert not list(frozen(replace(run.signals, torque=step * np.round(run.signals.torque / step)), ROBOT.joint_names))


def test_a_coarse_meter_beside_slow_motion_did_not_freeze(run):
    time = run.signals.time
    slow = np.interp(time, [0, 9, 11, 20], [0, 9, 9.05, 18.05])  # hardly moves from 9 to 11 s
    q = np.column_stack([5 * np.interp(slow, time, q) for q in run.signals.q.T])
    power = 10 * np.round(np.interp(slow, time, 40 * run.signals.power) / 10)
    assert not list(frozen(replace(run.signals, q=q, torque=None, power=power), ROBOT.joint_names))


def test_a_meter_without_joints_tells_of_no_motion(run):
    power = run.signals.power.copy()
    power[800:900] = power[800]
    metered = Signals(run.signals.time, np.empty((len(power), 0)), power=power)
    assert not list(frozen(metered, ()))


def test_a_torque_at_its_limit_did_not_freeze(run):
    most = np.quantile(run.signals.torque, 0.99, axis=0)
    assert not list(frozen(replace(run.signals, torque=np.minimum(run.signals.torque, most)), ROBOT.joint_names))
