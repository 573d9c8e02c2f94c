"""A variable's name as a reader's heading."""

from __future__ import annotations

import pytest

from irtwin.report.wording import heading


@pytest.mark.parametrize(
    ("name", "shown"),
    [
        ("energy_j", "Energy, J"),
        ("energy_J", "Energy, J"),
        ("mean_power_W", "Mean power, W"),
        ("torque_constant_nm_a", "Torque constant, N m/A"),
        ("rotor_inertia_kg_m2", "Rotor inertia, kg m²"),
        ("speed_rad_s", "Speed, rad/s"),
        ("error_percent", "Error, %"),
        ("co2_kg", "CO₂, kg"),
        ("r_squared", "R squared"),
        ("meanPower_W", "Mean Power, W"),
        ("robot", "Robot"),
        ("s", "S"),
        ("_", "_"),
        ("measured_at", "Measured at"),
    ],
)
def test_a_heading_names_its_unit(name: str, shown: str) -> None:
    assert heading(name) == shown
