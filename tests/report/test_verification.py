"""What a change saved: against sums by hand, and how often the interval holds the truth."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from irtwin.report.plant.verification import verification

DAY = "2026-03-10"


def run(day: str, energy_j: float, **said: Any) -> dict[str, Any]:
    made = {"time_s": 3600.0, "pieces": None, "cycles": None, "product": None, "payload_kg": 1.0}
    return {"day": day, "energy_j": energy_j, **made, **said}


BEFORE = [run("2026-03-01", joules) for joules in (98.0, 100.0, 102.0)]
AFTER = [run("2026-03-20", joules) for joules in (89.0, 90.0, 91.0, 90.0)]


def test_a_saving_is_the_adjusted_baseline_less_what_was_measured() -> None:
    found = verification([*BEFORE, *AFTER], DAY)
    assert (found.words, found.unit, found.before, found.after) == ("verified", "hour", 3, 4)
    assert (found.adjusted_j, found.saved_j) == pytest.approx((400.0, 40.0))
    # variances of the means: 4/3 and (2/3)/4, times 4²; Welch's degrees of freedom 2.51
    assert found.half_width_j == pytest.approx(3.5682 * 4 * (4 / 3 + 1 / 6) ** 0.5, rel=1e-3)
    assert (found.lower_j + found.upper_j) / 2 == pytest.approx(40.0)


def test_it_is_adjusted_to_what_was_made() -> None:
    twice = [run("2026-03-20", 2 * one["energy_j"], time_s=7200.0) for one in AFTER]
    assert verification([*BEFORE, *twice], DAY).saved_j == pytest.approx(80.0)
    pieces = [{**one, "pieces": 10} for one in BEFORE] + [{**one, "pieces": 5} for one in AFTER]
    fewer = verification(pieces, DAY)
    assert (fewer.unit, fewer.words) == ("piece", "not verified")
    assert fewer.saved_j == pytest.approx(20 * 10.0 - 360.0)
    assert verification([*pieces, run("2026-03-02", 100.0)], DAY).unit == "hour"  # one that counts none


def test_another_product_is_no_saving() -> None:
    heavy, light = ([{**one, "product": name} for one in AFTER] for name in ("heavy", "light"))
    early = [{**one, "product": "heavy", "energy_j": one["energy_j"]} for one in BEFORE]
    assert verification([*early, *light], DAY).words == "too few runs"
    mixed = verification([*early, *heavy, *light], DAY)
    assert (mixed.before, mixed.after, mixed.saved_j) == (3, 4, pytest.approx(40.0))
    assert verification([*BEFORE, *[{**one, "payload_kg": 5.0} for one in AFTER]], DAY).words == "too few runs"


def test_runs_of_the_day_and_beyond_the_next_change_count_on_neither_side() -> None:
    others = [run(DAY, 1e9), run("2026-02-01", 1e9), run("2026-04-01", 1e9)]
    assert verification([*BEFORE, *AFTER, *others], DAY, after="2026-02-10", until="2026-03-25").saved_j == (
        pytest.approx(40.0)
    )


@pytest.mark.parametrize(("runs", "counts"), [([], (0, 0)), (BEFORE, (3, 0)), ([*BEFORE, *AFTER[:2]], (3, 2))])
def test_too_few_runs_are_told(runs: list[dict[str, Any]], counts: tuple[int, int]) -> None:
    found = verification(runs, DAY)
    assert (found.words, found.adjusted_j, (found.before, found.after)) == ("too few runs", None, counts)


def test_runs_without_any_scatter_have_no_interval() -> None:
    same = [*[run("2026-03-01", 10.0)] * 3, *[run("2026-03-20", 9.0)] * 3]
    assert (verification(same, DAY).half_width_j, verification(same, DAY).words) == (0.0, "verified")


@pytest.mark.parametrize(("saved", "counts"), [(0.0, (5, 5)), (0.1, (8, 4))])
def test_nineteen_of_twenty_intervals_hold_what_was_saved(saved: float, counts: tuple[int, int]) -> None:
    rng, held, verified, tries = np.random.default_rng(7), 0, 0, 400
    for _ in range(tries):
        pieces = [rng.integers(10, 30, count) for count in counts]
        rates = (100.0, 100.0 * (1.0 - saved))
        runs = [
            run(day, rate * made + 20.0 * np.sqrt(made) * rng.normal(), pieces=made)
            for day, rate, side in zip(("2026-03-01", "2026-03-20"), rates, pieces, strict=True)
            for made in side
        ]
        found = verification(runs, DAY)
        held += found.lower_j <= 100.0 * saved * pieces[1].sum() <= found.upper_j
        verified += found.words == "verified"
    assert 0.92 < held / tries < 0.99
    assert verified / tries < 0.05 if saved == 0.0 else verified / tries > 0.8
