"""Effects on what is drawn from the mains."""

from itertools import accumulate

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from irtwin.effects.effect import Predicted
from irtwin.effects.supply import BusCapacitor
from irtwin.resources import folder
from irtwin.robot.urdf import read_urdf
from irtwin.signals.motion import Motion

ROBOT = read_urdf(folder("ontology") / "robots" / "kuka_kr6_r700.urdf")


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=70), st.floats(0.1, 100.0))
def test_the_flow_into_the_bus_is_that_of_a_store_filled_sample_by_sample(axes: list[float], most: float) -> None:
    time = np.arange(len(axes)) / 10
    still = np.zeros((len(axes), 6))
    motion = Motion(time, still, still, still, run="run")
    flow = BusCapacitor(E=most).columns(ROBOT, motion, Predicted(still, axes=np.array(axes)))[:, 0] * most
    held = list(accumulate(axes, lambda before, power: min(max(before - power / 10, 0.0), most), initial=0.0))
    np.testing.assert_allclose(flow, np.diff(held) * 10, atol=1e-9 * 1e3)
