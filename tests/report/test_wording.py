from datetime import UTC, datetime, timedelta, timezone

import pytest
from tests.html_elements import plain

from irtwin.report import wording


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (1234.6, "1 235"), (12345.6, "12 346"), (0.012345, "0.0123"), (-3.14159, "−3.14"), (9.999, "10.0"),
        (999.9, "1 000"), (1.5e-7, "1.50 × 10⁻⁷"), (-2.5e9, "−2.50 × 10⁹"), (None, "–"), (float("nan"), "–"),
        (float("inf"), "–"),
    ],
)  # fmt: skip
def test_number_keeps_significant_digits(value: float | None, text: str):
    assert plain(wording.number(value)) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (8900.0, "2.47 Wh"),
        (12.0, "3.33 mWh"),
        (3.6e6, "1.00 kWh"),
        (-150.0, "−0.0417 Wh"),
        (-1.8e-6, "0 mWh"),
        (None, "–"),
    ],
)
def test_energy_finds_its_unit(value: float | None, text: str):
    assert plain(wording.energy(value)) == text


@pytest.mark.parametrize(("value", "text"), [(0.97, "97 %"), (0.998, "99.8 %"), (1.0, "100 %"), (-0.2, "−20 %")])
def test_share_does_not_claim_all_short_of_it(value: float, text: str):
    assert plain(wording.share(value)) == text


@pytest.mark.parametrize(
    ("seconds", "text"), [(9.0, "9.00 s"), (119.0, "119 s"), (725.0, "12 min 5 s"), (7380.0, "2 h 3 min")]
)
def test_duration_in_words(seconds: float, text: str):
    assert plain(wording.duration(seconds)) == text


def test_given_numbers_keep_their_own_digits():
    assert plain(wording.given(50.0, "kg")) == "50 kg"
    assert plain(wording.given(-170.5)) == "−170.5"
    assert wording.given(None, "kg") == "–"


def test_angles_are_degrees_and_prismatic_joints_millimetres():
    assert wording.angle(-2.967, "revolute") == "−170°"
    assert plain(wording.angle(0.25, "prismatic")) == "250 mm"
    assert wording.angle(float("inf"), "continuous") == "–"
    assert wording.angular_speed(None, "revolute") == "–"


@pytest.mark.parametrize(
    ("numbers", "texts"),
    [
        ((7.1432, 7.04, 7.24), ("7.14", "7.04 … 7.24")),
        ((150.0, 149.9, 150.1), ("150.00", "149.90 … 150.10")),
        ((1234.0, 1000.0, 1500.0), ("1 234", "1 000 … 1 500")),
        ((2e-9, 1e-9, 3e-9), ("2.00 × 10⁻⁹", "1.00 × 10⁻⁹ … 3.00 × 10⁻⁹")),
        ((5.0, 5.0, 5.0), ("5.00", "5.00 … 5.00")),
    ],
)
def test_an_interval_says_how_many_decimals_make_sense(numbers: tuple[float, float, float], texts: tuple[str, str]):
    assert tuple(map(plain, wording.interval(*numbers))) == texts


def test_units_are_printed_with_real_powers():
    assert wording.unit_symbol("kg m^2") == "kg m²"
    assert wording.unit_symbol("N m s^-1") == "N m s⁻¹"
    assert wording.unit_symbol("ohm") == "Ω"
    assert wording.unit_symbol("1") == wording.unit_symbol(None) == ""


def test_moments_are_utc():
    berlin = timezone(timedelta(hours=1))
    assert wording.moment(datetime(2026, 3, 1, 8, 30, tzinfo=berlin)) == "2026-03-01 07:30"
    assert wording.moment(datetime(2026, 3, 1, 8, 30)) == wording.moment(datetime(2026, 3, 1, 8, 30, tzinfo=UTC))


def test_names_are_listed_as_in_a_sentence():
    assert wording.listed(["a"]) == "a"
    assert wording.listed(["a", "b", "c"]) == "a, b and c"


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
    assert wording.heading(name) == shown
