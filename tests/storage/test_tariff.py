"""`plant.toml`: what it may say, and what it is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from irtwin.errors import InputError
from irtwin.storage.tariff import Tariff, read_tariff


def read(folder: Path, text: str) -> Tariff:
    (folder / "plant.toml").write_text(text, encoding="utf-8")
    return read_tariff(folder)


def test_nobody_said(tmp_path: Path) -> None:
    assert read_tariff(tmp_path) == Tariff()


def test_all_of_it(tmp_path: Path) -> None:
    tariff = read(tmp_path, 'price_per_kwh = 0.2\ncurrency = "EUR"\nco2_kg_per_kwh = 0.38\n')
    assert tariff == Tariff(price=0.2, currency="EUR", co2=0.38)
    assert read(tmp_path, "co2_kg_per_kwh = 0\n") == Tariff(co2=0.0)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("price_per_kWh = 0.2", "price_per_kWh is not known; did you mean price_per_kwh?"),
        ("robots = 3", "robots is not known; it may have price_per_kwh, currency, co2_kg_per_kwh"),
        ("price_per_kwh = 0.2", "price_per_kwh needs a currency"),
        ('price_per_kwh = "0.2"', "price_per_kwh should be a number of at least 0, not '0.2'"),
        ("co2_kg_per_kwh = -1", "co2_kg_per_kwh should be a number of at least 0, not -1"),
        ("co2_kg_per_kwh = inf", "not inf"),
        ("co2_kg_per_kwh = true", "not True"),
        ("name = ' '", "name should be text, not ' '"),
        ('currency = "<script>"', "currency is a code or a sign"),
    ],
)
def test_what_cannot_be_used(tmp_path: Path, text: str, message: str) -> None:
    with pytest.raises(InputError, match=r"plant\.toml") as refused:
        read(tmp_path, text)
    assert message in str(refused.value)
