from __future__ import annotations

import numpy as np

from irtwin.demo.plant.machine import Drawings
from irtwin.demo.plant.thermal import Thermal


def test_settles_where_losses_flow_through_the_resistances(drawings: Drawings) -> None:
    data, copper, body = drawings.thermal, np.full(6, 10.0), np.full(6, 15.0)
    thermal = Thermal(data)
    thermal.wait(copper, body, 6 * 3600)
    np.testing.assert_allclose(thermal.body, data.ambient + data.body_resistance * 25, rtol=1e-3)
    np.testing.assert_allclose(thermal.winding - thermal.body, data.winding_resistance * 10, rtol=1e-3)


def test_warm_up_takes_minutes_and_a_night_cools(drawings: Drawings) -> None:
    thermal, nothing = Thermal(drawings.thermal), np.zeros(6)
    rise = drawings.thermal.body_resistance * 40
    thermal.wait(nothing, np.full(6, 40.0), 600)
    assert ((thermal.body - 22 > 0.4 * rise) & (thermal.body - 22 < 0.9 * rise)).all()
    thermal.wait(nothing, nothing, 12 * 3600)
    np.testing.assert_allclose(thermal.body, 22.0, atol=0.1)
