"""The script that hands a diagnosis over to MuJoCo's own system identification."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from tests import servo_arm
from tests.data_sets import irtwin

from irtwin.simulator import sysid_script
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.model import read_model
from irtwin.simulator.servos import NAMES, servos
from irtwin.simulator.sysid import free, written

ROBOT = {"stiffness": (12.0, 15.0), "delay": (0.0, 0.03), "offset": (0.02, 0.0), "damping": (1.5, 0.7)}


def chosen(own, **numbers):
    robots = servo_arm.changed(own, **numbers)
    played = SimpleNamespace(at=own.chart(robots))
    return DifferingNumbers(SimpleNamespace(servos=own), played, None, robots != own.numbers, None, None)


@pytest.fixture
def arm(tmp_path):
    data, model = servo_arm.write(tmp_path, {"a": servo_arm.swings(6, 0)})
    return data, model, servo_arm.read(data, model)


def test_what_differs_is_free_in_the_words_of_the_model(arm):
    own = arm[2][2]
    told = {(of, number): rest for of, number, *rest in free(chosen(own, **ROBOT, payload=(0.1, 0.1)))}
    assert list(told) == [
        ("lift", "kp"), ("lift", "kv"), ("lift", "offset"), ("elbow", "delay"), ("lower", "mass"),
    ]  # fmt: skip
    assert np.concatenate(told["lift", "kv"][:2]) == pytest.approx([0.8, 1.4])  # of servo and joint 0.1 is the joint's
    assert told["lower", "mass"][1] == pytest.approx([0.2, 0.1, 0.0, 0.0])
    for model, robot, least, most in told.values():
        assert all(low < one < high for low, one, high in zip(least, robot, most, strict=True))
        assert all(low <= one <= high for low, one, high in zip(least, model, most, strict=True))
    assert told["elbow", "delay"][2] == [0.0]


def test_what_differs_behind_a_gear_is_free_as_the_file_has_it(tmp_path):
    text = servo_arm.MODEL.replace('kp="20" kv="0.8" ctrlrange="-1.5 1.5"', 'kp="5" kv="0.2" gear="2"')
    own = servo_arm.read(*servo_arm.write(tmp_path, {"a": servo_arm.swings(6, 0)}, text))[2]
    told = {number: (model[0], robot[0]) for _, number, model, robot, *_ in free(chosen(own, **ROBOT))}
    assert told["kp"] == pytest.approx((5.0, 3.0))
    assert told["kv"] == pytest.approx((0.2, 0.35))
    assert told["offset"] == pytest.approx((0.0, 0.04))


def test_gravity_of_a_tilted_base_is_free_along_two_axes(arm):
    ((of, number, model, robot, *_),) = free(chosen(arm[2][2], tilt_x=(0.05, 0.05)))
    assert (of, number, model) == ("world", "gravity", [0.0, 0.0])
    assert robot == pytest.approx([0.0, 9.81 * np.sin(0.05)])


def test_files_are_named_from_where_the_script_is(tmp_path):
    model, logs, out = tmp_path / "a" / "robot's.xml", tmp_path / "logs", tmp_path / "b" / "fit.py"
    said = written((), (), model, logs, out).decode().splitlines()
    own = Path(sysid_script.__file__).read_text(encoding="utf-8").splitlines()
    (changed,) = set(said) - set(own)
    assert changed == """MODEL, LOGS, FITTED = "../a/robot's.xml", '../logs', 'fit-fitted.xml'"""


def test_without_commands_no_script_is_asked_for(tmp_path):
    assert "--simulator: give that too" in irtwin("diagnose", tmp_path, "--save-sysid", tmp_path / "fit.py").err


def fitted(data, model, read, folder, robot, capsys):
    """Run the script that begins a fifth beside what a robot has, on a log of it; return what it prints."""
    data_set, _, own = read
    made = servo_arm.played(data_set, own, servo_arm.changed(own, **robot))
    for run in made.runs:
        servo_arm.log(run.file, data_set.robot, run.signals)
    near = chosen(own, **{name: tuple(1.2 * one for one in some) for name, some in robot.items()})
    place = folder / "fit.py"
    folder.mkdir()
    place.write_bytes(
        written(free(near), ["servo_dead_band of lift"], model, data, place, own.model.gains, own.model.joints)
    )
    spec = importlib.util.spec_from_file_location("fit", place)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    module.main()
    return capsys.readouterr().out


def test_gains_that_are_told_are_fitted_too_and_written_as_servos(tmp_path, capsys):
    """Of a URDF, whose controller damps towards commanded speeds."""
    pytest.importorskip("tabulate", reason="mujoco[sysid] is not installed")
    data, _ = servo_arm.write(tmp_path, {"a": servo_arm.swings(6, 0)})
    file, model = data / "dataset.toml", tmp_path / "arm.urdf"
    file.write_text(file.read_text().replace("[[run]]", f"{servo_arm.GAINS}[[run]]", 1), encoding="utf-8")
    model.write_text(servo_arm.URDF, encoding="utf-8")
    data_set, *rest = servo_arm.read(data, model)
    (run,) = data_set.runs
    speed = np.gradient(run.signals.command, run.signals.time, axis=0)
    run = replace(run, signals=replace(run.signals, command_speed=speed))
    robot = {"stiffness": (14.0, 15.0), "damping": (0.8, 0.9)}
    said = fitted(data, model, (replace(data_set, runs=(run,)), *rest), tmp_path / "fits", robot, capsys)
    assert "lift kp" in said
    assert "elbow damping" in said
    found = servos(read_model(tmp_path / "fits" / "fit-fitted.xml", data_set.robot)).numbers
    assert found[:2] == pytest.approx(np.array(list(robot.values())), rel=0.03)


def test_mujocos_own_fit_ends_at_the_robots_numbers(arm, tmp_path, capsys):
    """It begins a fifth beside them, and is told that the model lacks a dead band."""
    pytest.importorskip("tabulate", reason="mujoco[sysid] is not installed")
    said = fitted(*arm, tmp_path / "fits", ROBOT, capsys)
    assert "cannot say: servo_dead_band of lift" in said
    assert "elbow delay" in said
    found = servos(read_model(tmp_path / "fits" / "fit-fitted.xml", arm[2][0].robot)).numbers
    for name, robot in ROBOT.items():
        assert found[NAMES.index(name)] == pytest.approx(robot, rel=0.02, abs=1e-3), name
