from __future__ import annotations

from collections import defaultdict
from dataclasses import FrozenInstanceError, replace

import numpy as np
import pinocchio as pin
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.synthetic import arm, measure, swing, with_constants

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.rigid_body import RigidBody, model_of
from irtwin.signals.motion import trapezoid
from irtwin.twin import twin as room
from irtwin.twin.identify import identify
from irtwin.twin.twin import Parameter

ALL = (*BASELINE, "copper_loss")
ROBOT = with_constants(arm(3))
TWIN = identify(ROBOT, [measure(ROBOT, swing(ROBOT, seed), noise=0.2) for seed in range(2)], ALL)


@settings(max_examples=10)
@given(seed=st.integers(0, 1000), payload=st.floats(0, 10), count=st.integers(1, 1500))
def test_ledger_sums_to_the_energy(seed, payload, count):
    motion = replace(swing(ROBOT, seed, seconds=15), payload_mass=payload).part(0, count)
    total = sum(entry.energy for entry in TWIN.ledger(motion))
    assert total == pytest.approx(TWIN.energy(motion), rel=1e-10, abs=1e-9)


def test_ledger_names_who_took_what():
    motion = swing(ROBOT, 3)
    entries = {(entry.effect, entry.joint): entry.energy for entry in TWIN.ledger(motion)}
    assert entries["standby_power", None] == pytest.approx(TWIN._values["standby_power", None, None, "P0"] * 19.99)
    for effect in ("viscous_friction", "coulomb_friction", "copper_loss"):
        assert all(entries[effect, joint] > 0 for joint in ROBOT.joint_names)
    # what measurement adds takes no energy, and mechanical power is entered under what takes it
    assert {effect for effect, _ in entries}.isdisjoint({"torque_offset", "mechanical_power"})


def test_work_of_bodies_is_kinetic_potential_and_the_load_lifted():
    """Over all joints each is the change of its energy, by Pinocchio; together they are what bodies took before."""
    motion = swing(ROBOT, 3, seconds=4)
    loaded = replace(motion, payload_mass=3.0, payload_com=(0.1, 0.0, 0.2))
    values = TWIN.torque_values

    def changes(of):
        model = model_of(ROBOT, TWIN.stack.bodies(of, values))
        data = model.createData()
        ends = ((of.q[k], of.dq[k]) for k in (0, -1))
        kinds = [
            (pin.computeKineticEnergy(model, data, *end), pin.computePotentialEnergy(model, data, end[0]))
            for end in ends
        ]
        return np.diff(kinds, axis=0)[0]

    def summed(of):
        sums = defaultdict(float)
        for entry in TWIN.ledger(of):
            sums[entry.effect] += entry.energy
        return sums

    alone, lifting = summed(motion), summed(loaded)
    assert "lifted_load" not in alone
    assert [alone["kinetic_energy"], alone["potential_energy"]] == pytest.approx(changes(motion), rel=1e-3, abs=1e-3)
    assert lifting["lifted_load"] == pytest.approx(sum(changes(loaded) - changes(motion)), rel=1e-3, abs=1e-3)
    assert {name: alone[name] for name in RigidBody.entries[:2]} == pytest.approx(
        {name: lifting[name] for name in RigidBody.entries[:2]}, rel=1e-9, abs=1e-9
    )
    weights = trapezoid(loaded.time)
    torque = TWIN.stack.torque_of([one for one in TWIN.stack.effects if one.bodies], loaded, values)
    for joint, work in zip(ROBOT.joint_names, weights @ (torque * loaded.dq), strict=True):
        parts = [one.energy for one in TWIN.ledger(loaded) if one.joint == joint and one.effect in RigidBody.entries]
        assert len(parts) == 3
        assert sum(parts) == pytest.approx(work, rel=1e-9, abs=1e-9)


def test_what_a_meter_adds_is_no_entry_of_the_ledger():
    motion = swing(ROBOT, 3, seconds=5)
    gain = Parameter("meter_gain", None, None, "g - 1", 0.1, "1")
    shown = replace(TWIN, effects=(*TWIN.effects, "meter_gain"), parameters=(*TWIN.parameters, gain), covariance=None)
    before, entries = TWIN.ledger(motion), shown.ledger(motion)
    assert [entry.effect for entry in entries] == [entry.effect for entry in before]
    assert [one.energy for one in entries] == pytest.approx([1.1 * one.energy for one in before])
    assert sum(entry.energy for entry in entries) == pytest.approx(shown.energy(motion), rel=1e-10)


@settings(max_examples=10)
@given(factor=st.floats(-3, 3))
def test_torque_is_linear_in_the_parameters(factor):
    motion = swing(ROBOT, 4, seconds=1)
    scaled = [replace(parameter, value=factor * parameter.value) for parameter in TWIN.parameters]
    np.testing.assert_allclose(
        replace(TWIN, parameters=tuple(scaled)).torque(motion), factor * TWIN.torque(motion), atol=1e-8
    )


def test_long_motions_are_worked_in_pieces(monkeypatch):
    motion = swing(ROBOT, 5, seconds=5)
    whole = TWIN.torque(motion), TWIN.power(motion), TWIN.ledger(motion)
    monkeypatch.setattr(room, "_PIECE", 37)
    np.testing.assert_allclose(TWIN.torque(motion), whole[0])
    np.testing.assert_allclose(TWIN.power(motion), whole[1])
    for entry, expected in zip(TWIN.ledger(motion), whole[2], strict=True):
        assert entry.energy == pytest.approx(expected.energy, abs=1e-9)


def test_power_without_an_effect_of_power_is_none():
    twin = identify(ROBOT, [measure(ROBOT, swing(ROBOT, 1))], ["rigid_body", "viscous_friction"])
    assert not twin.power(swing(ROBOT, 2)).any()
    assert twin.ledger(swing(ROBOT, 2)) == ()


def test_a_twin_cannot_be_changed():
    with pytest.raises(FrozenInstanceError):
        TWIN.cutoff = 3.0


def test_measured_torque_is_current_times_constant_where_no_torque_was_logged():
    motion = measure(ROBOT, swing(ROBOT, 1))
    np.testing.assert_array_equal(TWIN.measured_torque(motion), motion.torque)
    np.testing.assert_allclose(TWIN.measured_torque(replace(motion, torque=None)), motion.current * 8.0)
    assert TWIN.measured_torque(swing(ROBOT, 1)) is None
    assert replace(TWIN, robot=arm(3)).measured_torque(replace(motion, torque=None)) is None
