"""Units: as they are written, and what makes SI units of them."""

from __future__ import annotations

import numpy as np
import pytest

from irtwin.signals.channels import CHANNELS
from irtwin.signals.unit import QUANTITIES, unit_of, units


def test_each_channel_is_in_the_si_unit_of_a_quantity() -> None:
    for channel in CHANNELS.values():
        assert {channel.unit, channel.sliding or channel.unit} <= set(QUANTITIES)


@pytest.mark.parametrize("si", QUANTITIES)
def test_the_si_unit_stands_first_and_changes_nothing(si: str) -> None:
    values = np.array([0.1, -3.0])
    assert units(si)[0].name == si
    assert units(si)[0].to_si(values) is values


@pytest.mark.parametrize(
    ("text", "si", "value", "true"),
    [
        ("°", "rad", 180.0, np.pi),
        ("µs", "s", 5.0, 5e-6),
        ("U/min", "rad/s", 60.0, 2 * np.pi),
        ("°/s", "rad/s", 180.0, np.pi),
        ("mN·m", "N m", 1500.0, 1.5),
        ("K", "degC", 300.0, 26.85),
        ("degF", "degC", 212.0, 100.0),
        ("kW", "W", 0.25, 250.0),
    ],
)
def test_a_unit_is_read_as_it_is_written(text: str, si: str, value: float, true: float) -> None:
    unit = unit_of(text, (si,))
    assert unit.to_si(np.array([value])) == pytest.approx([true])


def test_capitals_count() -> None:
    assert unit_of("mW", ("W",)) != unit_of("MW", ("W",))
    assert unit_of("s", ("W",)) is None
