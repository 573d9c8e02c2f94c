from __future__ import annotations

import numpy as np

from irtwin.demo.plant.drive import Drive
from irtwin.demo.plant.machine import Drawings

WARM, REFERENCE = np.full(6, 85.0), np.full(6, 25.0)


def _holding(drawings: Drawings, torque: np.ndarray, temperature: np.ndarray = REFERENCE) -> tuple[Drive, np.ndarray]:
    drive = Drive(drawings.drive)
    for _ in range(50):
        given = drive.torque(torque, temperature, 5e-4)
    return drive, given


def test_current_follows_within_milliseconds(drawings: Drawings) -> None:
    wanted = np.array([50.0, -60, 20, 5, 3, 1])
    drive, given = _holding(drawings, wanted)
    np.testing.assert_allclose(given, wanted, rtol=1e-9)
    np.testing.assert_allclose(drive.current, wanted / drawings.drive.joint_torque_constant)
    half = Drive(drawings.drive).torque(wanted, REFERENCE, 0.001)
    np.testing.assert_allclose(half / wanted, 1 - np.exp(-1))


def test_warm_magnets_give_less_torque_for_the_same_current(drawings: Drawings) -> None:
    _, given = _holding(drawings, np.full(6, 10.0), WARM)
    np.testing.assert_allclose(given, 10.0 * (1 - 0.0011 * 60))


def test_losses(drawings: Drawings) -> None:
    drive, _ = _holding(drawings, np.full(6, 10.0))
    cold, warm = drive.losses(np.zeros(6), REFERENCE), drive.losses(np.ones(6), WARM)
    np.testing.assert_allclose(cold.copper, drawings.drive.resistance * drive.current**2)
    np.testing.assert_allclose(warm.copper / cold.copper, 1 + 0.0039 * 60)
    assert (cold.iron == 0).all() and (warm.iron > 0).all()
    assert cold.total == cold.copper.sum() + cold.inverter.sum()
    assert Drive(drawings.drive).losses(np.zeros(6), WARM).total == 0
