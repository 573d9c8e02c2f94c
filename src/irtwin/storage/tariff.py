"""What a kilowatt hour costs and emits at this plant: said once, in `plant.toml` of the workspace, never guessed.

The graph is told it as the individual `tariff:electricity`; what follows from it is concluded there.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field
from difflib import get_close_matches
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from irtwin.errors import InputError
from irtwin.storage.base_iri import KEY
from irtwin.toml_text import read_toml

FILE = "plant.toml"  # in a workspace; a person writes it
_YEAR = 8784  # hours of the longest
_KEYS = ("price_per_kwh", "currency", "co2_kg_per_kwh", "hours_a_year", "time_zone", KEY)
_CURRENCY = re.compile(r"[^\W\d_]{1,8}|[$€£¥₹₩]")


@dataclass(frozen=True)
class Tariff:
    """Price and emission factor of a kWh, and the hours that robots are on in a year, None where nobody said; the
    plant's clock."""

    price: float | None = None  # currency/kWh
    currency: str = ""
    co2: float | None = None  # kg/kWh
    hours: float | None = None  # a year
    zone: ZoneInfo = field(default_factory=lambda: ZoneInfo("UTC"))


def read_tariff(workspace: Path) -> Tariff:
    """Read `plant.toml` of a workspace; an empty tariff where there is none. InputError where it cannot be used."""
    file = workspace / FILE
    if not file.exists():
        return Tariff()
    values = read_toml(file)
    for key in values:
        if key not in _KEYS:
            near = get_close_matches(key, _KEYS, n=1)
            hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(_KEYS)}"
            raise InputError(f"{file}: unknown key {key!r}: {hint}")
    price, currency = _number(file, values, "price_per_kwh"), values.get("currency", "")
    if not isinstance(currency, str) or (currency and not _CURRENCY.fullmatch(currency)):
        raise InputError(f'{file}: currency is a code or a sign, as "EUR", not {currency!r}')
    if price is not None and not currency:
        raise InputError(f'{file}: price_per_kwh needs a currency, as currency = "EUR"')
    hours = _number(file, values, "hours_a_year")
    if hours is not None and hours > _YEAR:
        raise InputError(f"{file}: hours_a_year is {_YEAR} at most, not {hours:g}")
    return Tariff(
        price, currency, _number(file, values, "co2_kg_per_kwh"), hours, _zone(file, values.get("time_zone", "UTC"))
    )


def _zone(file: Path, name: Any) -> ZoneInfo:
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, TypeError, OSError):
        raise InputError(f'{file}: time_zone is a name as "Europe/Berlin", not {name!r}') from None


def _number(file: Path, values: dict[str, Any], key: str) -> float | None:
    value = values.get(key)
    if value is None:
        return None
    if isinstance(value, bool) or not isinstance(value, int | float) or not (math.isfinite(value) and value >= 0):
        raise InputError(f"{file}: {key} is a number of 0 or more, not {value!r}")
    return float(value)
