from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests import data_sets, mujoco_models, synthetic

from irtwin.errors import InputError
from irtwin.gap.data.case import case_of
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.progress import telling
from irtwin.signals.log import read_data_set
from irtwin.simulator.model import read_model, with_simulated_runs

ROBOT = synthetic.arm(3)


def made(folder, **changes):
    runs = [synthetic.as_run(synthetic.measure(ROBOT, synthetic.swing(ROBOT, seed, seconds=8.0))) for seed in (1, 2)]
    runs = [replace(run, signals=replace(run.signals, **changes)) for run in runs]
    model = mujoco_models.write(folder / "arm.xml", ROBOT, damping=synthetic.truth(ROBOT)["Fv"])
    return read_data_set(data_sets.write(folder / "data", ROBOT, runs)), read_model(model, ROBOT)


def test_each_observed_run_has_the_models_torque_beside_it(tmp_path):
    data_set, model = made(tmp_path)
    both = with_simulated_runs(data_set, model)
    assert [run.role for run in both.runs] == ["observed", "observed", "simulated", "simulated"]
    assert both.runs[2].name == f"{both.runs[0].name} in arm"
    motion, run = synthetic.swing(ROBOT, 1, seconds=8.0), both.runs[2]
    expected = synthetic.rigid_torque(ROBOT, motion) + synthetic.truth(ROBOT)["Fv"] * motion.dq
    middle = slice(100, -100)
    np.testing.assert_allclose(run.signals.torque[middle], expected[middle], atol=0.02 * np.abs(expected).max())


def test_reference_runs_are_left_out_beside_a_simulator_and_that_is_said(tmp_path):
    data_set, model = made(tmp_path)
    first, second = data_set.runs
    said: list[str] = []
    both = with_simulated_runs(replace(data_set, runs=(replace(first, role="reference"), second)), model)
    with telling(said.append):
        case = case_of(both, (), DEFAULT)
    assert [run.role for run in case.runs] == ["observed", "simulated"]
    assert case.against == "simulated"
    assert "  beside a simulator reference runs are left out: 1" in said


def test_simulated_runs_beside_a_model_are_refused(tmp_path):
    data_set, model = made(tmp_path)
    twice = with_simulated_runs(data_set, model)
    with pytest.raises(InputError, match=r"has simulated runs of its own; leave these out"):
        with_simulated_runs(twice, model)


def test_a_log_without_torque_is_refused(tmp_path):
    data_set, model = made(tmp_path, torque=None, current=None)
    with pytest.raises(InputError, match=r"no run has torque to hold the simulator against"):
        with_simulated_runs(data_set, model)


def test_a_run_of_commands_alone_beside_runs_with_torque_is_refused(tmp_path):
    data_set, model = made(tmp_path)
    first, second = data_set.runs
    alone = replace(second, signals=replace(second.signals, torque=None, current=None, power=None))
    with pytest.raises(InputError, match=r"has commands and no torque, where other runs have torque; leave it out"):
        with_simulated_runs(replace(data_set, runs=(first, alone)), model)
