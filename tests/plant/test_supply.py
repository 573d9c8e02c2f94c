from __future__ import annotations

import pytest

from irtwin.demo.plant.machine import Drawings
from irtwin.demo.plant.supply import Supply

STEP = 5e-4


def test_an_idle_bus_draws_standby_only(drawings: Drawings) -> None:
    supply = Supply(drawings.supply)
    assert supply.advance(0.0, STEP).grid == pytest.approx(110.0)


def test_steady_demand_comes_from_the_mains(drawings: Drawings) -> None:
    supply = Supply(drawings.supply)
    for _ in range(400):
        flow = supply.advance(800.0, STEP)
    assert flow.grid == pytest.approx(110 + 800 + flow.rectifier)
    assert 0 < flow.rectifier < 30


def test_nothing_goes_back_and_the_chopper_burns_what_the_bus_cannot_hold(drawings: Drawings) -> None:
    supply = Supply(drawings.supply)
    start, burnt, highest = supply.stored, 0.0, 0.0
    for _ in range(2000):
        flow = supply.advance(-300.0, STEP)
        burnt += STEP * flow.chopper
        highest = max(highest, supply.voltage)
        assert flow.grid == 110.0
    assert burnt == pytest.approx(300.0 - (supply.stored - start))
    assert highest < drawings.supply.chopper_on + 1


def test_the_bus_gives_back_before_the_mains_feed_it(drawings: Drawings) -> None:
    supply = Supply(drawings.supply)
    for _ in range(50):
        supply.advance(-400.0, STEP)  # 10 J
    assert not supply.chopping
    assert supply.advance(400.0, STEP).grid == 110.0
