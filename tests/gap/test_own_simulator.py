"""What a user's own simulator lacks: noiseless runs of the robot as drawn, beside one that was built a little off."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.data_sets import irtwin_does, write
from tests.synthetic import arm, as_run, heavier, measure, rigid_torque, swing, truth

pytestmark = pytest.mark.slow
DRAWN = arm(4)
BUILT = heavier(DRAWN, *(1 + 0.1 * np.random.default_rng(5).standard_normal(4)))
DIFFERS_ANYWAY = {"rigid_body", "torque_offset"}  # masses by ten percent, and the sensors' offsets


def runs(effect, friction):
    """Observed runs with an effect (torque of a motion), and simulated ones of other motions, with friction or not."""
    made, true = [], truth(DRAWN)
    for seed in range(5):
        motion = replace(swing(DRAWN, seed, seconds=5.0), run=f"observed_{seed}")
        shown = measure(BUILT, motion, noise=0.3, seed=seed)
        made.append(as_run(replace(shown, torque=shown.torque + effect(motion), power=None, current=None)))
    for seed in range(3):
        motion = replace(swing(DRAWN, 20 + seed, seconds=5.0), run=f"simulated_{seed}")
        torque = rigid_torque(DRAWN, motion) + true["Ia"] * motion.ddq
        torque += friction * (true["Fc"] * np.sign(motion.dq) + true["Fv"] * motion.dq)
        made.append(replace(as_run(replace(motion, torque=torque)), role="simulated"))
    return made


def stribeck(motion):
    added = np.zeros_like(motion.dq)
    added[:, 2] = 4 * np.sign(motion.dq[:, 2]) * np.exp(-np.abs(motion.dq[:, 2]) / 0.1)
    return added


def diagnosed(folder, effect, friction):
    said = irtwin_does("diagnose", write(folder / "data", DRAWN, runs(effect, friction)), "--json", folder / "out.json")
    causes = json.loads((folder / "out.json").read_text())["causes"]
    assert {cause["scope"] for cause in causes} == {"changed"}
    return said.out, {cause["effect"]: set(cause["joints"]) for cause in causes}


@pytest.mark.nightly
def test_the_friction_that_the_simulator_lacks_is_named_on_its_joint(tmp_path):
    said, causes = diagnosed(tmp_path, stribeck, friction=1.0)
    assert causes.pop("stribeck_friction") == {"joint_3"}
    assert set(causes) <= DIFFERS_ANYWAY
    assert "differs from the simulator" in said
    assert "stribeck friction" in said


@pytest.mark.parametrize("noise", [0.0, pytest.param(0.3, marks=pytest.mark.nightly)])
def test_equal_logs_of_simulator_and_robot_show_no_gap(tmp_path, noise):
    """Whatever both have that the twin lacks: here friction with a sharp sign, and one that grows with the root."""
    made, true, rng = [], truth(DRAWN), np.random.default_rng(0)
    for seed in range(3):
        motion = swing(DRAWN, seed, seconds=5.0)
        torque = rigid_torque(DRAWN, motion) + true["Ia"] * motion.ddq + true["Fc"] * np.sign(motion.dq)
        torque += true["Fv"] * np.sign(motion.dq) * np.sqrt(np.abs(motion.dq))
        for role in ("simulated", "observed"):
            heard = torque + (noise * rng.standard_normal(torque.shape) if role == "observed" else 0.0)
            made.append(replace(as_run(replace(motion, torque=heard, run=f"{role}_{seed}")), role=role))
    irtwin_does("diagnose", write(tmp_path / "data", DRAWN, made), "--json", tmp_path / "out.json")
    document = json.loads((tmp_path / "out.json").read_text())
    assert (document["verdict"], document["causes"]) == ("no_gap", [])


def test_damping_that_differs_from_the_simulators_logs_has_both_numbers_and_closes_the_gap(tmp_path):
    """Joint 1 of both has friction that grows with the root of speed, which the twin lacks: no part of the gap."""
    made, true, rng = [], truth(DRAWN), np.random.default_rng(0)
    for seed in range(3):
        motion = swing(DRAWN, seed, seconds=5.0)
        torque = rigid_torque(DRAWN, motion) + true["Ia"] * motion.ddq + true["Fc"] * np.sign(motion.dq)
        torque[:, 0] += 10 * np.sign(motion.dq[:, 0]) * np.sqrt(np.abs(motion.dq[:, 0]))
        for role, damping in {"simulated": 20.0, "observed": 40.0}.items():
            heard = torque + damping * motion.dq * (np.arange(4) == 2) + 0.1 * rng.standard_normal(torque.shape)
            made.append(replace(as_run(replace(motion, torque=heard, run=f"{role}_{seed}")), role=role))
    said = irtwin_does("diagnose", write(tmp_path / "data", DRAWN, made), "--json", tmp_path / "out.json")
    document = json.loads((tmp_path / "out.json").read_text())
    (cause,) = document["causes"]
    (damping,) = cause["parameters"]
    assert (cause["effect"], cause["joints"]) == ("viscous_friction", ["joint_3"])
    assert [damping[key] for key in ("simulator", "robot", "value")] == pytest.approx([20.0, 40.0, 20.0], rel=0.05)
    assert "damping (Fv) of joint_3 40.0 N m s/rad in place of 20.0" in said.out
    change = document["shrink"]["torque_rmse"]
    assert change["after"] > 3 * change["noise_floor"]
    assert document["shrink"]["closed_fraction"]["value"] > 0.95
    assert "Adding this to the simulator closes" in said.out


@pytest.mark.nightly
def test_a_simulator_without_friction_lacks_all_of_it(tmp_path):
    _, causes = diagnosed(tmp_path, lambda motion: 0.0, friction=0.0)
    everywhere = set(DRAWN.joint_names)
    assert causes.pop("coulomb_friction") == everywhere
    assert causes.pop("viscous_friction") == everywhere
    assert set(causes) <= DIFFERS_ANYWAY
