"""How sure the scale of torque is, and what carries it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from tests.synthetic import arm, as_run, data_set, measure, rigid_torque, swing, truth, with_torque

from irtwin.effects.catalogue import BASELINE
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.isolation.finding import quantities
from irtwin.robot.kinematics import flange
from irtwin.robot.model import inverse_dynamics
from irtwin.signals.conditioning import condition
from irtwin.twin.torque_scale import torque_scale

pytestmark = pytest.mark.usefixtures("no_experiment")

ROBOT = arm(3)
LOAD, GAIN = 3.0, 1.09  # kg at the flange; of every drive's torque constant


def loaded_torque(motion, mass):
    """What a mass at the flange adds, by inverse dynamics of a heavier last body."""
    model = ROBOT.model.copy()
    frame = model.frames[model.getFrameId(flange(ROBOT), pin.FrameType.BODY)]
    load = frame.placement.act(pin.Inertia(mass, np.array([0.02, 0.0, 0.1]), 1e-3 * mass * np.eye(3)))
    model.inertias[frame.parentJoint] = model.inertias[frame.parentJoint] + load
    return inverse_dynamics(model, motion.q, motion.dq, motion.ddq) - rigid_torque(ROBOT, motion)


def logged(gain, *, power):
    """Runs without and with the load, of drives whose torque is read too high by a gain; power is right."""
    made = []
    for seed in range(6):
        role, mass = ("reference", 0.0) if seed < 3 else ("observed", LOAD)
        motion = replace(swing(ROBOT, seed, seconds=10.0), run=f"run_{seed}")
        added = loaded_torque(motion, mass) if mass else np.zeros_like(motion.dq)
        shown = with_torque(ROBOT, measure(ROBOT, motion, noise=0.3, seed=seed), added)
        run = as_run(replace(shown, torque=gain * shown.torque, power=shown.power if power else None))
        made.append(replace(run, role=role))
    return replace(data_set(ROBOT, made, (*BASELINE, "copper_loss"), "dc_bus"), simulated=False)


@pytest.mark.slow
def test_a_mass_weighed_by_drives_that_read_high_lies_in_its_interval():
    found = diagnose(logged(GAIN, power=False))
    (load,) = (one for one in found.document.causes if one.effect == "payload")
    mass = next(one for one in load.parameters if one.name == "m")
    assert mass.value == pytest.approx(GAIN * LOAD, rel=0.03)
    assert mass.interval95[0] < LOAD < mass.interval95[1]
    said = found.document.torque_scale
    assert (said.uncertainty95, said.source) == (0.1, "assumed")
    assert "nominal constants" in said.why
    finding, cause = found.causes[0]
    of_fit = next(one for one in quantities(ROBOT, finding, cause) if one.name == "m")
    assert of_fit.lower > LOAD


def scale(**changes):
    data = replace(logged(1.0, power=False), **changes)
    return torque_scale(data, [condition(data.runs[0], ROBOT, 10.0)], lambda motion: motion.torque)


def test_where_the_uncertainty_comes_from():
    assert scale().source == "assumed"
    assert (scale(notes={"torque": "joint torque sensor"}).uncertainty, scale(simulated=True).uncertainty) == (0.02, 0)
    assert scale(notes={"torque": "link-side joint torque"}).source == "sensor"
    assert scale(notes={"torque": "motor torque times gear ratio"}).source == "assumed"
    assert scale(simulated=True).why == "The scale of torque is exact: a simulator made it"
    stated = scale(torque_scale_uncertainty=0.05, notes={"torque": "joint torque sensor"})
    assert (stated.source, stated.uncertainty) == ("stated", 0.05)


def test_constants_that_power_told_are_not_nominal_and_power_does_not_count_again():
    data = logged(1.0, power=True)
    runs = tuple(replace(run, signals=replace(run.signals, torque=None)) for run in data.runs)
    motions = [condition(run, ROBOT, 10.0) for run in data.runs]
    for simulated in (False, True):
        of_currents = replace(data, runs=runs, simulated=simulated)
        found = torque_scale(of_currents, motions, lambda motion: motion.torque)
        assert (found.source, found.uncertainty, found.low, found.high) == ("assumed", 0.1, 1 / 1.1, 1 / 0.9)
        assert found.why.endswith("10 %: power tells the torque constants, joint by joint")


@pytest.mark.parametrize("gain", [0.92, 1.0, GAIN])
def test_power_on_the_bus_narrows_the_scale(gain):
    data = logged(gain, power=True)
    motions = [condition(run, ROBOT, 10.0) for run in data.runs]
    offset = gain * truth(ROBOT)["c"]

    def real(motion):
        return motion.torque - offset

    found = torque_scale(data, motions, real)
    assert found.low < 1 / gain < found.high
    assert found.high - found.low < 0.06
    assert "narrows" in found.why
    at_mains = torque_scale(replace(data, power_at="mains"), motions, real)
    assert (at_mains.low, at_mains.high) == (1 / 1.1, 1 / 0.9)


def test_power_that_contradicts_does_not_count():
    data = logged(1.6, power=True)
    motions = [condition(run, ROBOT, 10.0) for run in data.runs]
    found = torque_scale(data, motions, lambda motion: motion.torque - 1.6 * truth(ROBOT)["c"])
    assert (found.low, found.high) == (1 / 1.1, 1 / 0.9)
    assert "does not count" in found.why
