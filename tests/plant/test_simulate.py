from __future__ import annotations

import numpy as np
import pytest

from irtwin.demo.plant.arm import PlantPayload
from irtwin.demo.plant.machine import Machine, build
from irtwin.demo.plant.motion import PlantMotion, programme
from irtwin.demo.plant.simulate import PlantRecording, simulate
from irtwin.demo.plant.thermal import Thermal

pytestmark = pytest.mark.slow

LADEN = PlantPayload(2.0)
MOVES = [
    {"to": [40, -60, 90, 30, 40, 60], "profile": "trapezoid", "pause": 0.2},
    {"to": [-30, -100, 70, -20, -40, 0], "pause": 0.2},
]


def _motion(machine: Machine) -> PlantMotion:
    return programme(MOVES, machine.drawings.limits, machine.drawings.step)


def _run(
    machine: Machine, seed: int = 1, motion: PlantMotion | None = None, payload: PlantPayload = LADEN
) -> PlantRecording:
    return simulate(machine, motion or _motion(machine), payload, Thermal(machine.drawings.thermal), seed)


@pytest.fixture(scope="module")
def recording(machine: Machine) -> PlantRecording:
    return _run(machine)


def test_energy_is_accounted_for(recording: PlantRecording) -> None:
    book = recording.book
    assert abs(book.residual()) < 1e-3 * (book.grid - book.standby)
    assert min(book.copper, book.iron, book.inverter, book.friction, book.rectifier) > 0


def test_energy_is_accounted_for_while_the_arm_ends_higher(machine: Machine) -> None:
    moves = [{"to": [0, -30, 60, 0, 0, 0]}, {"to": [0, -90, 60, 0, 0, 0], "pause": 0.1}]
    both = programme(moves, machine.drawings.limits, 5e-4)
    second = slice(len(both.q) // 2, None)
    up = PlantMotion(both.q[second], both.dq[second], both.ddq[second])
    book = _run(machine, motion=up, payload=PlantPayload()).book
    assert book.mechanical > 50
    assert abs(book.residual()) < 2e-3 * (book.grid - book.standby)


def test_same_seed_same_log(machine: Machine, recording: PlantRecording) -> None:
    again, other = _run(machine), _run(machine, seed=2)
    np.testing.assert_array_equal(again.torque, recording.torque)
    np.testing.assert_array_equal(again.power, recording.power)
    assert (other.torque != recording.torque).any()


def test_follows_its_programme_within_the_limits(machine: Machine, recording: PlantRecording) -> None:
    limits, drawings = machine.drawings.limits, machine.drawings
    programmed = _motion(machine).q[:: round(drawings.log_interval / drawings.step)]
    assert np.abs(recording.true_q - programmed).max() < 0.03
    assert (recording.true_q > limits.lower).all() and (recording.true_q < limits.upper).all()
    assert (np.abs(recording.true_torque) < 1.05 * drawings.drive.maximum_torque).all()


def test_log_is_what_plausible_sensors_see(machine: Machine, recording: PlantRecording) -> None:
    assert np.diff(recording.time) == pytest.approx(0.012)
    assert np.abs(recording.q - recording.true_q).max() < 2e-6
    assert (np.abs(recording.torque - recording.true_torque).std(0) < 2 * machine.drawings.sensors.torque_noise).all()
    assert recording.power.min() > 100
    assert recording.power.max() < 2000
    assert (recording.temperature[-1] >= 22).all() and recording.temperature.max() < 30


def test_power_at_rest_is_standby_and_holding(machine: Machine) -> None:
    rows = np.repeat(np.radians([[0.0, -60, 60, 0, 0, 0]]), 2000, axis=0)
    rest = _run(machine, motion=PlantMotion(rows, 0 * rows, 0 * rows), payload=PlantPayload())
    assert rest.power.mean() == pytest.approx(115, abs=6)
    assert rest.power.std() < 3


def test_stops_where_the_drives_cannot_follow(machine: Machine) -> None:
    with pytest.raises(RuntimeError, match="cannot follow"):
        _run(machine, payload=PlantPayload(60.0, (0.1, 0, 0)))


def test_robots_of_one_drawing_differ(machine: Machine, recording: PlantRecording) -> None:
    other = _run(build(machine.drawings, seed=2))
    assert np.abs(other.true_torque - recording.true_torque).max() > 3
