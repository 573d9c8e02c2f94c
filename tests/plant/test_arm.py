from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from irtwin.demo.plant.arm import Arm, LinkTolerance, PlantPayload
from irtwin.demo.plant.machine import Drawings, Machine


def _states(drawings: Drawings, count: int) -> list[np.ndarray]:
    rng, limits = np.random.default_rng(3), drawings.limits
    q = rng.uniform(limits.lower, limits.upper, (count, 6))
    return list(zip(q, rng.uniform(-4, 4, (count, 6)), rng.uniform(-20, 20, (count, 6)), strict=True))


def test_inverse_dynamics_agrees_with_pinocchio(drawings: Drawings) -> None:
    model = pin.buildModelFromXML(drawings.urdf)
    model.armature[:] = drawings.drive.joint_inertia
    data, arm = model.createData(), drawings.arm(PlantPayload())
    assert list(model.names)[1:] == drawings.joints
    for state in _states(drawings, 50):
        np.testing.assert_allclose(arm.inverse_dynamics(*state), pin.rnea(model, data, *state), atol=1e-9)


def test_payload_hangs_at_its_centre_of_mass(drawings: Drawings) -> None:
    com = (0.05, 0.01, -0.02)
    model = pin.buildModelFromXML(drawings.urdf)
    with_payload = drawings.arm(PlantPayload(3.0, com))
    model.armature[:] = drawings.drive.joint_inertia
    model.appendBodyToJoint(
        6, pin.Inertia(3.0, np.array(com), 3.0 * (0.06 * 3 ** (1 / 3)) ** 2 / 6 * np.eye(3)), pin.SE3.Identity()
    )
    data = model.createData()
    for state in _states(drawings, 10):
        np.testing.assert_allclose(with_payload.inverse_dynamics(*state), pin.rnea(model, data, *state), atol=1e-9)


def test_forward_dynamics_inverts_inverse_dynamics(drawings: Drawings) -> None:
    arm = drawings.arm(PlantPayload())
    for q, dq, ddq in _states(drawings, 5):
        torque = arm.inverse_dynamics(q, dq, ddq)
        arm.place(q)
        arm.data.qvel[:] = dq
        np.testing.assert_allclose(arm.advance(torque), ddq, rtol=1e-9, atol=1e-9)


def test_joint_inertia_is_the_torque_of_a_unit_acceleration(drawings: Drawings) -> None:
    arm, rest = drawings.arm(PlantPayload()), np.zeros(6)
    q = _states(drawings, 1)[0][0]
    for joint, unit in enumerate(np.eye(6)):
        torque = arm.inverse_dynamics(q, rest, unit) - arm.inverse_dynamics(q, rest, rest)
        assert arm.joint_inertia(q)[joint] == pytest.approx(torque[joint])


def test_built_links_are_off_but_physical(drawings: Drawings, machine: Machine) -> None:
    drawn, built = drawings.arm(PlantPayload(2.0)).model, machine.arm(PlantPayload(2.0)).model
    for body in range(1, drawn.nbody):
        moments = np.sort(built.body_inertia[body])
        assert moments[0] + moments[1] >= moments[2] * (1 - 1e-12)
    links = [drawn.body(f"link_{number}").id for number in range(1, 7)]
    off = built.body_mass[links] / drawn.body_mass[links] - 1
    assert 0.02 < np.abs(off).max() <= 0.2
    assert np.abs(built.body_ipos[links] - drawn.body_ipos[links]).max() <= 0.01
    payload = drawn.body("payload").id
    assert built.body_mass[payload] == 2.0


def test_same_seed_builds_the_same_arm(drawings: Drawings) -> None:
    def mass(seed: int) -> np.ndarray:
        arm = Arm(drawings.urdf, drawings.drive.joint_inertia, PlantPayload(), drawings.step)
        arm.perturb(LinkTolerance(0.1, 0.1, 0.005), np.random.default_rng(seed))
        return arm.model.body_mass.copy()

    np.testing.assert_array_equal(mass(5), mass(5))
    assert (mass(5) != mass(6)).any()
