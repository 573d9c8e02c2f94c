from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from irtwin.demo.plant.friction import Friction
from irtwin.demo.plant.machine import Drawings

STEP = 5e-4
NO_LOAD = np.zeros(6)


def _steady(drawings: Drawings, speed: float, temperature: float = 40.0, load: float = 0.0) -> np.ndarray:
    """Return the mean friction over half a second at a constant speed."""
    friction = Friction(drawings.friction, drawings.drive.joint_inertia)
    dq, warm = np.full(6, speed), np.full(6, temperature)
    torques = [friction.torque(i * STEP * dq, dq, np.full(6, load), warm, STEP) for i in range(2000)]
    return np.mean(torques[1000:], axis=0)


def test_creeping_meets_stiction_and_speed_meets_oil(drawings: Drawings) -> None:
    data = drawings.friction
    np.testing.assert_allclose(_steady(drawings, 3e-3), data.coulomb + data.stiction, rtol=0.05)
    oil = data.viscous * data.thinning_speed * np.arcsinh(2.0 / data.thinning_speed)
    np.testing.assert_allclose(_steady(drawings, 2.0), data.coulomb + oil, rtol=0.02)


def test_odd_in_speed(drawings: Drawings) -> None:
    np.testing.assert_allclose(_steady(drawings, 1.0), -_steady(drawings, -1.0), rtol=0.01)


@pytest.mark.slow
def test_falls_as_the_oil_warms_and_rises_with_load(drawings: Drawings) -> None:
    cold, warm = _steady(drawings, 3.0, 22.0), _steady(drawings, 3.0, 47.0)
    assert ((warm / cold > 0.5) & (warm / cold < 0.85)).all()
    np.testing.assert_allclose(_steady(drawings, 3.0, load=50.0) - _steady(drawings, 3.0), 1.5, rtol=0.05)


def test_holds_like_a_spring_before_it_slides(drawings: Drawings) -> None:
    friction = Friction(drawings.friction, drawings.drive.joint_inertia)
    tiny = 1e-5  # rad, a small part of the bristle deflection
    for _ in range(100):
        torque = friction.torque(np.zeros(6), np.full(6, tiny / (100 * STEP)), NO_LOAD, np.full(6, 40.0), STEP)
    held = friction.torque(np.zeros(6), np.zeros(6), NO_LOAD, np.full(6, 40.0), STEP)
    np.testing.assert_allclose(held, friction.stiffness * tiny, rtol=0.05)
    assert (torque > 0).all()


def test_takes_energy_over_any_cycle(drawings: Drawings) -> None:
    data = replace(drawings.friction, mesh_ripple=np.zeros(6))
    friction = Friction(data, drawings.drive.joint_inertia)
    time = np.arange(0, 2, STEP)
    speed = 0.02 * np.cos(2 * np.pi * time)
    work = sum(friction.torque(NO_LOAD, np.full(6, v), NO_LOAD, np.full(6, 30.0), STEP) * v * STEP for v in speed)
    assert (np.asarray(work) > 0).all()
    assert np.asarray(work)[0] == pytest.approx((data.coulomb + data.stiction)[0] * 0.02 * 4 / np.pi, rel=0.15)
