"""What a controller adds to its servos by a model of its own."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests import servo_arm

from irtwin.errors import InputError
from irtwin.signals.log import read_data_set
from irtwin.simulator.alone import alone
from irtwin.simulator.feedforward import Feedforward
from irtwin.simulator.model import read_model
from irtwin.simulator.play import each, play, whole
from irtwin.simulator.playing import diagnose
from irtwin.simulator.servos import servos
from irtwin.simulator.trusted import NOTHING

FRICTIONLESS = servo_arm.MODEL.replace('frictionloss="0.05"', 'frictionloss="0"').replace('damping="0.1"', "")


def fed(folder, commands, kind, text=FRICTIONLESS):
    """Return a data set whose controller has a feedforward and knows the rotors, and the servos of its model."""
    data, model = servo_arm.write(folder, commands, text)
    file = data / "dataset.toml"
    told = file.read_text("utf-8").replace("[robot]", f'[robot]\nfeedforward = "{kind}"', 1)
    rotors = "".join(f"[robot.joint.{joint}]\nrotor_inertia = 0.02\n" for joint in ("lift", "elbow"))
    file.write_text(told + rotors, "utf-8")
    data_set = read_data_set(data, commanded=True)
    return data_set, servos(read_model(model, data_set.robot))


@pytest.mark.parametrize("default", ["", '<motor gear="30" ctrlrange="-0.1 0.1" forcerange="-1e-3 1e-3"/>'])
def test_gravity_that_is_added_leaves_no_sag(tmp_path, default):
    text = FRICTIONLESS.replace("</default>", f"{default}</default>").replace("<position", '<position gear="1"')
    text = text.replace('kv="0.6"', 'kv="0.6" forcerange="-8 8"')
    data_set, own = fed(tmp_path, {"a": np.full((150, 2), 0.4)}, "gravity", text)
    q = play(own, [own.numbers], [whole(data_set.runs[0])])[0][0][-1, 0]
    np.testing.assert_allclose(q, 0.4, atol=1e-6)


def sines(seconds, seed=0, pace=1.0):
    """Return commands (N, 2) that a controller plans: smooth, from rest."""
    time, own = np.arange(int(50 * seconds)) / 50, pace * np.random.default_rng(seed).uniform(2.0, 5.0, 2)
    return 0.5 * np.sin(np.outer(time, own)) * np.clip(time - 1, 0, 1)[:, None] ** 2


def test_a_model_that_knows_the_robot_follows_its_commands(tmp_path):
    undamped = FRICTIONLESS.replace('kv="0.8"', 'kv="0.01"').replace('kv="0.6"', 'kv="0.01"')
    missed = {}
    for kind in ("gravity", "dynamics"):
        data_set, own = fed(tmp_path / kind, {"a": sines(6)}, kind, undamped)
        stretch = whole(data_set.runs[0])
        missed[kind] = np.abs(play(own, [own.numbers], [stretch])[0][0][:, 0] - stretch.q).max()
    assert missed["dynamics"] < 0.5 * missed["gravity"]  # each command is held until the next


def test_the_torque_is_that_of_the_robot_as_drawn_its_rotors_and_its_told_load(tmp_path):
    data_set, _ = fed(tmp_path, {"a": sines(6)}, "dynamics")
    robot, (run,) = data_set.robot, data_set.runs
    run = replace(run, payload_mass=0.5, payload_com=(0.0, 0.0, 0.1))
    found = Feedforward(robot).torque(run, run.signals.time, np.zeros(2))
    q, gap = run.signals.command, 1 / 50
    dq, ddq = np.gradient(q, gap, axis=0), np.gradient(np.gradient(q, gap, axis=0), gap, axis=0)
    model = robot.model.copy()
    model.appendBodyToJoint(2, pin.Inertia(0.5, np.array([0.0, 0.0, 0.1]), np.zeros((3, 3))), pin.SE3.Identity())
    data = model.createData()
    by_pinocchio = [pin.rnea(model, data, *state) for state in zip(q, dq, ddq, strict=True)] + 0.02 * ddq
    np.testing.assert_allclose(found[5:90], by_pinocchio[5:90], atol=0.01)


def test_a_joint_by_itself_has_it_too(tmp_path):
    data_set, own = fed(tmp_path, {"a": sines(6, pace=0.25)}, "dynamics", servo_arm.MODEL)
    data_set = servo_arm.played(data_set, own, own.numbers, noise=0.0, torque_noise=0.0)
    stretches = each(data_set.runs[0], 2.0, 2)
    blind = servos(replace(own.model, robot=replace(own.model.robot, feedforward=None)))
    near, far = (
        max(np.abs(one.measured - played)[:, 0].max() for one, played in zip(stretches, single, strict=True))
        for single in (alone(arm, stretches, 0.005).play([own.numbers])[0] for arm in (own, blind))
    )
    assert 2 * near < far


@pytest.mark.slow
def test_what_the_controller_does_not_know_is_found(tmp_path):
    data_set, own = fed(
        tmp_path, {name: sines(8, seed) for seed, name in enumerate("abc")}, "dynamics", servo_arm.MODEL
    )
    robot = servo_arm.changed(own, friction=(0.05, 0.3))
    document = diagnose(servo_arm.played(data_set, own, robot), own.model, NOTHING, ()).document
    (cause,) = (cause for cause in document.causes if not cause.folded_away)
    assert (cause.effect, cause.joints) == ("coulomb_friction", ("elbow",))
    (number,) = cause.parameters
    assert number.robot == pytest.approx(0.3, rel=0.05)


def test_a_kind_that_is_none_is_refused(tmp_path):
    with pytest.raises(InputError, match=r'\[robot\] feedforward = "all"; use gravity or dynamics'):
        fed(tmp_path, {"a": np.zeros((100, 2))}, "all")
