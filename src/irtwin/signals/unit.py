"""Units that logs come in, and what makes SI units of them."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

import numpy as np

MOTOR = "motor "  # before a unit: on the motor's side of the gear


@dataclass(frozen=True)
class Unit:
    """A unit of a quantity that is named by its SI unit: SI = `factor` * value + `offset`."""

    name: str
    si: str
    factor: float
    offset: float = 0.0

    def to_si(self, values: np.ndarray) -> np.ndarray:
        """Return values in the SI unit; the very values where they are in it."""
        return values if (self.factor, self.offset) == (1.0, 0.0) else self.factor * values + self.offset


_TURN, _DEGREE = 2 * math.pi, math.pi / 180
# by SI unit: (name, factor, how else it is written); capitals count, blanks, dots and underscores do not
_TABLE: dict[str, tuple[tuple[str, float, str], ...]] = {
    "s": (
        ("s", 1.0, "sec secs second seconds"),
        ("ms", 1e-3, "msec milliseconds millis"),
        ("us", 1e-6, "usec"),
        ("ns", 1e-9, "nsec nanoseconds"),
    ),
    "rad": (
        ("rad", 1.0, "radian radians"),
        ("deg", _DEGREE, "degree degrees grad Grad"),
        ("mrad", 1e-3, ""),
        ("rev", _TURN, "turn turns U"),
    ),
    "m": (("m", 1.0, ""), ("mm", 1e-3, ""), ("cm", 1e-2, "")),
    "rad/s": (
        ("rad/s", 1.0, "rads"),
        ("deg/s", _DEGREE, "degs dps grad/s Grad/s"),
        ("rpm", _TURN / 60, "1/min U/min min^-1 rev/min"),
        ("rev/s", _TURN, "1/s turns/s"),
    ),
    "m/s": (("m/s", 1.0, ""), ("mm/s", 1e-3, "")),
    "rad/s^2": (
        ("rad/s^2", 1.0, "rad/s2 rads2 rad/s/s"),
        ("deg/s^2", _DEGREE, "deg/s2 degs2 deg/s/s"),
    ),
    "m/s^2": (("m/s^2", 1.0, "m/s2"), ("mm/s^2", 1e-3, "mm/s2")),
    "N m": (("N m", 1.0, "N*m NM newtonmeter"), ("mN m", 1e-3, "mN*m"), ("kN m", 1e3, "kN*m")),
    "N": (("N", 1.0, ""), ("kN", 1e3, "")),
    "A": (("A", 1.0, "amp amps ampere amperes"), ("mA", 1e-3, "milliamps")),
    "degC": (("degC", 1.0, "C celsius Celsius"), ("K", 1.0, "kelvin Kelvin"), ("degF", 5 / 9, "F fahrenheit")),
    "W": (("W", 1.0, "watt watts Watt"), ("kW", 1e3, "KW kilowatt"), ("mW", 1e-3, "milliwatt")),
    "V": (("V", 1.0, "volt volts Volt"), ("mV", 1e-3, "millivolt")),
}
_OFFSETS = {"K": -273.15, "degF": -160 / 9}


def units(si: str) -> list[Unit]:
    """Return the units of a quantity, its SI unit first."""
    return [Unit(name, si, factor, _OFFSETS.get(name, 0.0)) for name, factor, _ in _TABLE[si]]


def unit_of(text: str, quantities: tuple[str, ...]) -> Unit | None:
    """Return the unit that a text writes, of one of these quantities; None where it writes none."""
    spelt = _spelt(text)
    return next((unit for si in quantities if (unit := _spellings(si).get(spelt)) is not None), None)


@cache
def _spellings(si: str) -> dict[str, Unit]:
    spellings: dict[str, Unit] = {}
    for unit, (name, _, others) in zip(units(si), _TABLE[si], strict=True):
        spellings |= {_spelt(spelling): unit for spelling in (name, *others.split())}
    return spellings


def _spelt(text: str) -> str:
    for was, instead in (("µ", "u"), ("μ", "u"), ("°", "deg"), ("²", "^2"), ("·", "*"), ("_per_", "/"), (" per ", "/")):
        text = text.replace(was, instead)
    return "".join(sign for sign in text if sign not in " ._")


QUANTITIES = tuple(_TABLE)
