"""How a variable of a query is written over a column: its words, and its unit. `energy_j` is "Energy, J"."""

from __future__ import annotations

import re

UNITS = {  # what a name may end in, and how that unit is printed; a name ends in the longest that fits
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


def heading(name: str) -> str:
    """Return a variable's name as a reader's heading; `assets/answer.js` does the same."""
    parts = [part for part in _HUMP.sub(r"\1_\2", name).split("_") if part]
    unit = ""
    for count in range(min(_LONGEST, len(parts) - 1), 0, -1):
        if (end := "_".join(parts[-count:])) in UNITS:
            unit, parts = UNITS[end], parts[:-count]
            break
    text = " ".join(WORDS.get(part.lower(), part) for part in parts) or name
    return f"{text[:1].upper()}{text[1:]}{', ' if unit else ''}{unit}"
