"""How numbers, units and names are put on a page."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from typing import Any

NONE = "–"  # stands where nobody said
_SPACE = "\N{NO-BREAK SPACE}"  # between a number and its unit
_THIN = "\N{NARROW NO-BREAK SPACE}"  # between thousands
_MINUS = "\N{MINUS SIGN}"
_POWER = re.compile(r"\^(-?\d+)")
_LEAST_SHARE = 0.1  # per cent
_ENERGY_UNITS = ((3.6e5, 3.6e6, "kWh"), (36.0, 3.6e3, "Wh"), (0.0, 3.6, "mWh"))  # J from which on, J of the unit
_LEAST_ENERGY = 1e-4  # J: what less a sum comes to is rounding
UNITS = {  # what a variable's name may end in, and how that unit is printed; it ends in the longest that fits
    "J": "J", "j": "J", "kJ": "kJ", "MJ": "MJ", "kWh": "kWh", "kwh": "kWh", "Wh": "Wh", "W": "W", "w": "W", "kW": "kW",
    "s": "s", "ms": "ms", "min": "min", "h": "h", "Hz": "Hz", "hz": "Hz", "m": "m", "mm": "mm", "m2": "m²", "m3": "m³",
    "kg": "kg", "kg_m2": "kg m²", "N": "N", "Nm": "N m", "nm": "N m", "A": "A", "V": "V", "ohm": "Ω",
    "Nm_A": "N m/A", "nm_a": "N m/A", "rad": "rad", "rad_s": "rad/s", "rad_s2": "rad/s²", "deg": "°", "deg_s": "°/s",
    "m_s": "m/s", "m_s2": "m/s²", "percent": "%", "degC": "°C", "degc": "°C", "K": "K", "UTC": "UTC", "EUR": "EUR",
}  # fmt: skip
WORDS = {
    "co2": "CO₂", "dh": "DH", "iri": "IRI", "rmse": "RMSE", "sha256": "SHA-256", "urdf": "URDF", "r": "R", "id": "ID",
    "dc": "DC", "ac": "AC",
}  # fmt: skip
_LONGEST = 3  # parts of a name that its unit may take
_HUMP = re.compile(r"([a-z])([A-Z][a-z])")


def number(value: float | int | None, digits: int = 3) -> str:
    """Write a number with so many significant digits: 12 345.6 -> "12 346", 1e-7 -> "1.00 × 10⁻⁷"."""
    if value is None or not math.isfinite(value):
        return NONE
    if value == 0:
        return "0"
    exponent = math.floor(math.log10(float(f"{abs(value):.{digits - 1}e}")))
    if not -4 <= exponent < 7:
        mantissa = f"{value / 10.0**exponent:.{digits - 1}f}"
        return f"{mantissa}{_SPACE}×{_SPACE}10{_superscript(exponent)}".replace("-", _MINUS)
    return decimals(value, max(digits - 1 - exponent, 0))


def decimals(value: float | None, count: int = 0) -> str:
    """Write a number with so many decimals: 12345.6 -> "12 346"."""
    if value is None or not math.isfinite(value):
        return NONE
    return f"{value:,.{count}f}".replace(",", _THIN).replace("-", _MINUS)


def given(value: float | None, unit: str = "") -> str:
    """Write a number that somebody gave, not one that was measured: all its digits and no more."""
    if value is None or not math.isfinite(value):
        return NONE
    text = f"{value:,.6g}" if abs(value) < 1e6 else f"{value:.6g}"
    return f"{text}{_SPACE}{unit}".rstrip().replace(",", _THIN).replace("-", _MINUS)


def quantity(value: float | None, unit: str, digits: int = 3) -> str:
    """Write a number and its unit."""
    return NONE if value is None else f"{number(value, digits)}{_SPACE}{unit}"


def shown(value: Any) -> str:
    """Write an answer of whatever kind: a number, a yes or no, a time, the end of an IRI or text."""
    if value is None:
        return NONE
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, int):
        return decimals(value)
    if isinstance(value, float):
        return number(value, 4)
    if isinstance(value, datetime):
        return moment(value)
    text = str(value)
    return local_name(text) if text.startswith(("http://", "https://")) else text


def percent(value: float | None, digits: int = 2) -> str:
    """Write a value that is already in per cent."""
    return quantity(value, "%", digits)


def share(value: float | None) -> str:
    """Write a share of 0 to 1 in per cent, without claiming 100 % short of it."""
    if value is None:
        return NONE
    hundredths = 100.0 * value
    return quantity(hundredths, "%", 3 if 99.0 < hundredths < 99.95 else 2)


def part(value: float | None) -> str:
    """Write a share as a sentence does, in which digits of next to nothing are of no use."""
    if value is not None and 0 < 100 * value < _LEAST_SHARE:
        return f"less than {_LEAST_SHARE:g}{_SPACE}%"
    return share(value)


def energy_unit(values: Iterable[float | None]) -> tuple[float, str]:
    """Return the divisor and the unit in which energies (J) of one table or figure are written."""
    largest = max((abs(value) for value in values if value is not None), default=0.0)
    return next((size, unit) for least, size, unit in _ENERGY_UNITS if largest >= least)


def energy(value: float | None, digits: int = 3) -> str:
    """Write an energy (J) as a bill does: in kWh, in Wh below a tenth of one."""
    if value is not None and abs(value) < _LEAST_ENERGY:
        value = 0.0
    size, unit = energy_unit([value])
    return NONE if value is None else quantity(value / size, unit, digits)


def duration(seconds: float | None) -> str:
    """Write a time span: "35.0 s", "12 min 5 s", "2 h 3 min"."""
    if seconds is None:
        return NONE
    if seconds < 120:
        return quantity(seconds, "s")
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 120:
        return f"{minutes}{_SPACE}min {rest}{_SPACE}s"
    return f"{minutes // 60}{_SPACE}h {minutes % 60}{_SPACE}min"


def angle(radians: float | None, kind: str | None) -> str:
    """Write a joint's position: degrees, or millimetres where it is prismatic."""
    if radians is None or not math.isfinite(radians):
        return NONE
    if kind == "prismatic":
        return given(round(radians * 1000, 1), "mm")
    return f"{given(round(math.degrees(radians), 1))}°"


def position(value: float | None, kind: str | None) -> str:
    """Write a joint's position to a tenth of a degree, or of a millimetre."""
    if value is None:
        return "–"
    text = f"{1000 * value:.1f} mm" if kind == "prismatic" else f"{math.degrees(value):.1f}°"
    return "0.0" + text[4:] if text.startswith("-0.0") else text.replace("-", "−")


def angular_speed(speed: float | None, kind: str | None) -> str:
    """Write a joint's speed: degrees a second, or millimetres a second where it is prismatic."""
    text = angle(speed, kind)
    return text if text == NONE else f"{text}/s"


def unit_symbol(unit: str | None) -> str:
    """Write a unit's symbol as it is printed: "kg m^2" -> "kg m²", "ohm" -> "Ω", "1" (no unit) -> ""."""
    if unit is None or unit == "1":
        return ""
    return _POWER.sub(lambda power: _superscript(int(power[1])), unit).replace("ohm", "Ω").replace("degC", "°C")


def moment(time: datetime | None, seconds: bool = False) -> str:
    """Write a point in time to the minute or second; it is UTC's."""
    if time is None:
        return NONE
    aware = time if time.tzinfo else time.replace(tzinfo=UTC)
    return aware.astimezone(UTC).strftime("%Y-%m-%d %H:%M:%S" if seconds else "%Y-%m-%d %H:%M")


def listed(names: Sequence[str]) -> str:
    """Write names as a sentence does: "a, b and c"."""
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def heading(name: str) -> str:
    """Return a query's variable as a reader's heading, "energy_j" -> "Energy, J"; `assets/answer.js` does the same."""
    parts = [part for part in _HUMP.sub(r"\1_\2", name).split("_") if part]
    unit = ""
    for count in range(min(_LONGEST, len(parts) - 1), 0, -1):
        if (end := "_".join(parts[-count:])) in UNITS:
            unit, parts = UNITS[end], parts[:-count]
            break
    text = " ".join(WORDS.get(part.lower(), part) for part in parts) or name
    return f"{text[:1].upper()}{text[1:]}{', ' if unit else ''}{unit}"


def local_name(iri: str) -> str:
    """Return the end of an IRI: ".../effect/coulomb_friction" -> "coulomb_friction"."""
    return iri.rstrip("/#").rsplit("/", 1)[-1].rsplit("#", 1)[-1]


def short_checksum(checksum: str | None) -> str:
    """Return the start of a checksum, enough to compare by eye."""
    return NONE if checksum is None else checksum.removeprefix("sha256:")[:12]


def interval(value: float, lower: float, upper: float) -> tuple[str, str]:
    """Write a value and its interval with as many decimals as the interval's width makes sensible."""
    half = (upper - lower) / 2
    if not (math.isfinite(half) and half > 0):
        return number(value), f"{number(lower)} … {number(upper)}"
    count = max(1 - math.floor(math.log10(float(f"{half:.1e}"))), 0)
    if count > 6:
        return number(value), f"{number(lower)} … {number(upper)}"
    return decimals(value, count), f"{decimals(lower, count)} … {decimals(upper, count)}"


def _superscript(exponent: int) -> str:
    return str(exponent).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
