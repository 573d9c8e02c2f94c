"""The plant and what a kilowatt hour costs and emits there: said once, in `plant.toml` of the workspace, never guessed.

The graph is told it as the individuals `plant/NAME` and `tariff:electricity`; what follows is concluded there.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from zoneinfo import ZoneInfo, ZoneInfoNotFoundError

from irtwin.errors import InputError
from irtwin.storage.base_iri import KEY
from irtwin.toml_file import TomlTable, read_toml

FILE = "plant.toml"  # in a workspace; a person writes it
_YEAR = 8784  # hours of the longest
_KEYS = ("price_per_kwh", "currency", "co2_kg_per_kwh", "hours_a_year", "time_zone", "name", KEY)
_CURRENCY = re.compile(r"[^\W\d_]{1,8}|[$€£¥₹₩]")


@dataclass(frozen=True)
class Tariff:
    """Price and emission factor of a kWh, and the hours that robots are on in a year, None where nobody said; the
    plant's clock and name."""

    price: float | None = None  # currency/kWh
    currency: str = ""
    co2: float | None = None  # kg/kWh
    hours: float | None = None  # a year
    zone: ZoneInfo = field(default_factory=lambda: ZoneInfo("UTC"))
    plant: str | None = None


def read_tariff(workspace: Path) -> Tariff:
    """Read `plant.toml` of a workspace; an empty tariff where there is none. InputError where it cannot be used."""
    file = workspace / FILE
    if not file.exists():
        return Tariff()
    table = TomlTable(file, "", read_toml(file))
    table.check_keys(_KEYS)
    price, currency = table.number("price_per_kwh", least=0.0), table.values.get("currency", "")
    if not isinstance(currency, str) or (currency and not _CURRENCY.fullmatch(currency)):
        raise InputError(f'{file}: currency is a code or a sign, as "EUR", not {currency!r}')
    if price is not None and not currency:
        raise InputError(f'{file}: price_per_kwh needs a currency, as currency = "EUR"')
    hours = table.number("hours_a_year", least=0.0)
    if hours is not None and hours > _YEAR:
        raise InputError(f"{file}: hours_a_year is {_YEAR} at most, not {hours:g}")
    zone = _zone(file, table.values.get("time_zone", "UTC"))
    return Tariff(price, currency, table.number("co2_kg_per_kwh", least=0.0), hours, zone, table.text("name"))


def _zone(file: Path, name: Any) -> ZoneInfo:
    try:
        return ZoneInfo(name)
    except (ZoneInfoNotFoundError, ValueError, TypeError, OSError):
        raise InputError(f'{file}: time_zone is a name as "Europe/Berlin", not {name!r}') from None
