"""What a user knows to be right is no cause."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests import servo_arm
from tests.data_sets import irtwin, write
from tests.synthetic import arm, as_run, measure, swing, truth

from irtwin.diagnosing import diagnose as diagnose_torque
from irtwin.effects.catalogue import catalogue
from irtwin.errors import InputError
from irtwin.simulator.playing import diagnose
from irtwin.simulator.servos import NAMES
from irtwin.simulator.trusted import NOTHING, trusted


def test_a_family_and_an_effect_stand_for_numbers_of_servos_too():
    assert trusted(()) == NOTHING
    bodies = trusted(["bodies"])
    assert bodies.effects == ("rigid_body", "rotor_inertia") and bodies.numbers == {"armature"}
    masses = trusted(["masses"])
    assert masses.effects == ("rigid_body",) and not masses.numbers
    some = trusted(["coulomb_friction", "command_delay", "external_contact"])
    assert some.effects == ("coulomb_friction", "external_contact")
    assert some.numbers == {"friction", "delay", "push"} and some.pushes


def test_what_is_neither_is_refused_with_the_families():
    said = r"trust weights: is neither a family of effects \(bodies, drive, .*\), nor masses, .*, nor an effect's id"
    with pytest.raises(InputError, match=said):
        trusted(["weights"])


@pytest.mark.slow
def test_numbers_that_are_trusted_stay_the_simulators(tmp_path):
    told = {name: servo_arm.swings(4, seed) for seed, name in enumerate("ab")}
    data_set, model, own = servo_arm.read(*servo_arm.write(tmp_path, told))
    made = servo_arm.played(data_set, own, servo_arm.changed(own, stiffness=(20.0, 10.0), damping=(0.9, 1.0)))
    found = diagnose(made, model, trusted(["friction", "load", "environment"]))
    names = ("damping", "friction", "holding", "spring", "payload", "tilt_x")
    rows = [NAMES.index(name) for name in names]
    np.testing.assert_allclose(found.chosen.numbers[rows], own.numbers[rows], rtol=1e-12)
    assert "servo_stiffness" in {one.effect for one in found.document.causes}


@pytest.mark.slow
def test_of_logged_torque_too_what_is_trusted_is_no_cause(tmp_path):
    robot, runs = arm(2), []
    for seed, role in enumerate(["reference"] * 3 + ["observed"] * 3):
        motion = replace(measure(robot, swing(robot, seed), noise=0.05, seed=seed), current=None, power=None)
        more = 0.5 * truth(robot)["Fc"] * [role == "observed", 0] * np.sign(motion.dq)
        run = as_run(replace(motion, torque=motion.torque + more))
        runs.append(replace(run, name=f"{role}_{seed}", role=role))
    folder = write(tmp_path / "set", robot, runs)
    doubted, held = (diagnose_torque(folder, trust=trust).document for trust in ((), ("friction",)))
    assert [(one.effect, one.joints) for one in doubted.causes] == [("coulomb_friction", ("joint_1",))]
    assert not {one.effect for one in held.causes} & {e.id for e in catalogue().values() if e.family == "friction"}


@pytest.mark.slow
def test_it_is_asked_for_on_the_command_line(tmp_path):
    said = irtwin("diagnose", tmp_path, "--trust", "weights")
    assert said.status == 2 and "trust weights: is neither a family" in said.err
