from __future__ import annotations

import numpy as np
import pytest

from irtwin.demo.plant.machine import Drawings
from irtwin.demo.plant.sensors import PowerMeter, TorqueSensors, encoder_steps, quantise


def test_encoders_see_steps_of_the_motor_shaft(drawings: Drawings) -> None:
    steps = encoder_steps(drawings.sensors, drawings.drive.gear_ratio)
    q = np.random.default_rng(0).uniform(-2, 2, 6)
    assert (np.abs(quantise(q, steps) - q) <= steps / 2 + 1e-15).all()
    assert (steps < 2e-6).all()


def test_torque_is_noisy_and_offset(drawings: Drawings) -> None:
    offset = np.array([1.0, 0, 0, 0, 0, -0.5])
    sensors = TorqueSensors(drawings.sensors, offset, np.random.default_rng(0))
    readings = np.array([sensors.read(np.full(6, 5.0)) for _ in range(4000)])
    np.testing.assert_allclose(readings.mean(0), 5.0 + offset, atol=0.03)
    np.testing.assert_allclose(readings.std(0), drawings.sensors.torque_noise, rtol=0.05)


def test_meter_lags(drawings: Drawings) -> None:
    meter = PowerMeter(drawings.sensors, gain=1.01, power=0.0, rng=np.random.default_rng(0))
    meter.advance(1000.0, drawings.sensors.meter_time_constant)
    assert meter.filtered == pytest.approx(1000 * (1 - np.exp(-1)))
    readings = [meter.read() for _ in range(2000)]
    assert np.mean(readings) == pytest.approx(1.01 * meter.filtered, abs=0.2)
