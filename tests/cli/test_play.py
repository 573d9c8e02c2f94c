"""A log's commands played through a model, from the command line."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from tests import servo_arm
from tests.data_sets import irtwin_does, irtwin_refuses

import irtwin

TOLD = {"a": servo_arm.swings(4, 0), "b": servo_arm.swings(4, 1)}


def play(model, data, *options):
    return "diagnose", data, "--simulator", model, "--play", *options


def logs(folder, torque_noise=None, **numbers):
    """Write a data set that a robot of some numbers made, and the model."""
    data, model = servo_arm.write(folder, TOLD)
    data_set, _, own = servo_arm.read(data, model)
    for run in servo_arm.played(data_set, own, servo_arm.changed(own, **numbers), torque_noise=torque_noise).runs:
        servo_arm.log(run.file, data_set.robot, run.signals)
    return data, model


def test_how_far_a_model_is_from_its_robot_is_told_by_run_joint_and_horizon(tmp_path):
    data, model = logs(tmp_path, torque_noise=5e-3, stiffness=(20.0, 8.0))
    said = irtwin_does(*play(model, data, "--json", tmp_path / "out.json"))
    for words in ("run ┃ tracking error, rad (m) ┃ flange, m ┃ torque, N m (N) ┃ energy error, %", "elbow │", "0.5 │"):
        assert words in " ".join(said.out.split()), said.out
    told = json.loads((tmp_path / "out.json").read_text())
    assert (told["robot"], told["simulator"], [run["run"] for run in told["runs"]]) == ("arm", "arm", ["a", "b"])
    assert told == irtwin.play(data, model).to_json()
    for run in told["runs"]:
        assert run["position_rmse"]["elbow"] > 4 * run["position_rmse"]["lift"] > 1e-3
        assert run["flange_rmse"] > 1e-4
        assert run["torque_rmse"]["elbow"] > 0.02
        assert run["energy_error_percent"] > 1.0
    errors = [one["position_rmse"] for one in told["horizons"]]
    assert [one["seconds"] for one in told["horizons"]] == [0.1, 0.2, 0.3, 0.4, 0.5]
    assert errors[0] < min(errors[1:])


def test_a_model_that_is_its_robot_leaves_the_noise_and_no_torque_is_told_where_none_was_logged(tmp_path):
    data, model = logs(tmp_path)
    told = irtwin.play(data, model)
    errors = [error for run in told.runs for error in run.position_rmse.values()]
    np.testing.assert_allclose(errors, 1e-3, rtol=0.15)
    assert all(run.torque_rmse is None and run.energy_error_percent is None for run in told.runs)
    assert "torque" not in irtwin_does(*play(model, data)).out


@pytest.mark.parametrize(("change", "words"), [
    (lambda signals: replace(signals, command=None), "a.parquet: has no commands to play; log cmd_JOINT"),
    (lambda signals: replace(signals, command=10 * signals.command), "commands are beyond the model's ctrlrange"),
])  # fmt: skip
def test_what_cannot_be_played_is_said_in_a_line(tmp_path, change, words):
    data, model = logs(tmp_path, torque_noise=5e-3)
    data_set = servo_arm.read(data, model)[0]
    for run in data_set.runs:
        servo_arm.log(run.file, data_set.robot, change(run.signals))
    assert words in irtwin_refuses(*play(model, data)).err


@pytest.mark.parametrize("played", [["--play"], []])
def test_a_model_that_is_unstable_is_said_in_a_line_and_leaves_no_file(tmp_path, monkeypatch, played):
    data, model = logs(tmp_path)
    model.write_text(model.read_text().replace('kp="15"', 'kp="1e9"'))
    monkeypatch.chdir(tmp_path)
    said = irtwin_refuses("diagnose", data, "--simulator", model, *played)
    assert f"{model}: its simulation is unstable" in said.err
    assert not (tmp_path / "MUJOCO_LOG.TXT").exists()


def test_the_model_and_the_logs_are_not_written_over(tmp_path):
    data, model = logs(tmp_path)
    assert "stays as it is" in irtwin_refuses(*play(model, data, "--json", model)).err
    assert "stays as it is" in irtwin_refuses(*play(model, data, "--json", data / "runs" / "a.parquet")).err


@pytest.mark.parametrize("option", [("--report", "a.html"), ("--trust", "bodies"), ("--workspace", "w"), ("--seed", 1)])
def test_what_is_of_a_diagnosis_does_not_go_with_a_play(tmp_path, option):
    data, model = logs(tmp_path)
    said = irtwin_refuses(*play(model, data, *option))
    assert f"{option[0]} is of a diagnosis, and does not go with --play" in said.err
    assert "--play plays the model of --simulator" in irtwin_refuses("diagnose", data, "--play").err
