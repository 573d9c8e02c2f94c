"""A model that has numbers of joints wrong, from the command line: they are named, and written back."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from tests import data_sets, mujoco_models, synthetic
from tests.data_sets import irtwin, irtwin_refuses

from irtwin.simulator.model import read_model
from irtwin.twin.files import load

pytestmark = pytest.mark.slow
ROBOT = synthetic.arm(3)
TRUE = synthetic.truth(ROBOT)


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    folder = tmp_path_factory.mktemp("beside")
    motions = [synthetic.swing(ROBOT, seed, seconds=8.0) for seed in range(4)]
    runs = [
        synthetic.as_run(synthetic.measure(ROBOT, motion, noise=0.1, seed=seed), power=None, current=None)
        for seed, motion in enumerate(motions)
    ]
    data = data_sets.write(folder / "data", ROBOT, runs, head="torque_scale_uncertainty = 0.0")
    numbers = {"armature": TRUE["Ia"], "damping": TRUE["Fv"].copy(), "frictionloss": TRUE["Fc"].copy()}
    numbers["damping"][1] *= 0.5
    numbers["frictionloss"][2] *= 1.5
    wrong = mujoco_models.write(folder / "arm.xml", ROBOT, **numbers)
    new = folder / "better.xml"
    return irtwin("diagnose", data, "--simulator", wrong, "--save-simulator", new, "--draws", 3), wrong, new


def test_both_numbers_are_told_as_the_simulators_and_the_robots(told):
    said = told[0]
    assert said.status == 0, said.err
    assert re.search(r"Fv[\w ]* +│ +2\.25 │ +4\.[45]\d* │ +2\.\d", said.out), said.out
    assert re.search(r"Fc[\w ]* +│ +3 │ +(2|2\.0\d|1\.9\d) │ +-(1|0\.9\d*|1\.0\d) ", said.out), said.out
    assert "No number of a joint holds torque offset (c of joint_1, joint_3)" in said.out


def test_the_models_numbers_become_the_robots(told):
    _, wrong, new = told
    model, before = read_model(new, ROBOT), read_model(wrong, ROBOT)
    assert model.numbers("joint_2")["damping"] == pytest.approx(TRUE["Fv"][1], rel=0.03)
    assert model.numbers("joint_3")["frictionloss"] == pytest.approx(TRUE["Fc"][2], rel=0.05)
    assert model.numbers("joint_1") == before.numbers("joint_1")


def test_draws_of_it_lie_where_its_numbers_could(told):
    _, wrong, new = told
    before = read_model(wrong, ROBOT)
    drawn = [read_model(new.with_stem(f"better-{number}"), ROBOT).numbers for number in (1, 2, 3)]
    dampings = [numbers("joint_2")["damping"] for numbers in drawn]
    assert len(set(dampings)) == 3 and dampings == pytest.approx([TRUE["Fv"][1]] * 3, rel=0.1)
    assert all(numbers("joint_1") == before.numbers("joint_1") for numbers in drawn)


def test_a_mass_and_a_rotor_that_are_off_together_are_told_and_written(tmp_path):
    """The rotor shows beside its link alone, which is not off: both are asked for once bodies are taken in."""
    robot = synthetic.arm(4)
    true = synthetic.truth(robot)
    runs = [
        synthetic.as_run(synthetic.measure(robot, synthetic.swing(robot, seed, 8.0), noise=0.1, seed=seed), power=None)
        for seed in range(5)
    ]
    *fitted, held_out = [replace(run, signals=replace(run.signals, current=None)) for run in runs]
    data = data_sets.write(tmp_path / "data", robot, fitted, head="torque_scale_uncertainty = 0.0")
    rotors = true["Ia"] * [1.0, 0.5, 1.0, 1.0]
    lighter = synthetic.heavier(robot, 1.0, 1.0, 1.0, 0.5)
    wrong = mujoco_models.write(
        tmp_path / "arm.xml", lighter, armature=rotors, damping=true["Fv"], frictionloss=true["Fc"]
    )
    new, closed = tmp_path / "better.xml", tmp_path / "closed.json"
    said = irtwin("diagnose", data, "--simulator", wrong, "--save-simulator", new, "--save-twin", closed)
    assert said.status == 0, said.err
    assert re.search(r"mass \(link_4\) of joint_4 +│ +1 │ +(1\.[89]|2|2\.[01])\d* ", said.out), said.out
    assert re.search(r"Ia of joint_2 ", said.out), said.out
    assert f"{new} has all bodies and rotors of the twin with the causes" in said.err
    before, after = read_model(wrong, robot), read_model(new, robot)
    assert after.numbers("joint_2")["armature"] == pytest.approx(true["Ia"][1], rel=0.1)
    motion = synthetic.swing(robot, 4, 8.0)
    torques = [model.torque(motion.q, motion.dq, motion.ddq) for model in (before, after)]
    left = [
        np.std(held_out.signals.torque - torque, axis=0).mean()  # a file has no offsets
        for torque in (*torques, load(closed).torque(motion))
    ]
    assert left[1] < 1.1 * left[2] < 0.5 * left[0], left


def test_a_file_for_the_model_needs_a_model(tmp_path):
    said = irtwin_refuses("diagnose", tmp_path, "--save-simulator", tmp_path / "new.xml")
    assert "--save-simulator writes the model of --simulator: give that too" in said.err
    said = irtwin("diagnose", tmp_path, "--draws", 2)
    assert (said.status, "--draws writes models beside that of --save-simulator" in said.err) == (2, True)


@pytest.fixture
def model(tmp_path):
    """A model beside a data set of one run."""
    run = synthetic.as_run(synthetic.measure(ROBOT, synthetic.swing(ROBOT, 0, seconds=1.0)))
    data_sets.write(tmp_path / "data", ROBOT, [replace(run, name="run_0")])
    return mujoco_models.write(tmp_path / "arm.xml", ROBOT)


@pytest.mark.parametrize("name", ["better.xml", "better-2.xml"])
def test_a_model_that_is_there_is_not_written_over(tmp_path, model, name):
    mine = tmp_path / name
    mine.write_text("mine")
    said = irtwin_refuses(
        "diagnose", tmp_path / "data", "--simulator", model, "--save-simulator", tmp_path / "better.xml", "--draws", 2
    )
    assert said.err.endswith(f"{mine}: is there already, and no model is written over; remove it, or name another\n")
    assert mine.read_text() == "mine" and len(list(tmp_path.glob("better*"))) == 1


@pytest.mark.parametrize(
    ("option", "name"),
    [
        ("--save-simulator", "arm.xml"),
        ("--report", "data/dataset.toml"),
        ("--json", "data/robot.urdf"),
        ("--save-simulator", "data/runs/run_0.parquet"),
    ],
)
def test_what_a_diagnosis_is_made_of_is_not_written_over(tmp_path, model, option, name):
    file = tmp_path / name
    before, other_name = file.read_bytes(), tmp_path / "data" / ".." / name
    said = irtwin("diagnose", tmp_path / "data", "--simulator", model, option, other_name)
    assert (said.status, file.read_bytes()) == (2, before)
    assert said.err.endswith(f"{other_name}: is what the diagnosis is made of, and stays as it is; name another file\n")
