"""Effects on what is drawn from the mains."""

from dataclasses import replace
from itertools import accumulate

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.synthetic import arm, measure, swing, truth, with_constants

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.effect import Predicted
from irtwin.effects.stack import Stack
from irtwin.effects.supply import BusCapacitor, HoldingBrakes
from irtwin.resources import folder
from irtwin.robot.urdf import read_urdf
from irtwin.signals.motion import Motion
from irtwin.twin.identify import identify

ROBOT = read_urdf(folder("ontology") / "robots" / "kuka_kr6_r700.urdf")


@given(st.lists(st.floats(-1e3, 1e3), min_size=2, max_size=70), st.floats(0.1, 100.0))
def test_the_flow_into_the_bus_is_that_of_a_store_filled_sample_by_sample(axes: list[float], most: float) -> None:
    time = np.arange(len(axes)) / 10
    still = np.zeros((len(axes), 6))
    motion = Motion(time, still, still, still, run="run")
    flow = BusCapacitor(E=most).columns(ROBOT, motion, Predicted(still, axes=np.array(axes)))[:, 0] * most
    held = list(accumulate(axes, lambda before, power: min(max(before - power / 10, 0.0), most), initial=0.0))
    np.testing.assert_allclose(flow, np.diff(held) * 10, atol=1e-9 * 1e3)


def test_closed_brakes_carry_the_links_so_that_no_current_heats() -> None:
    robot = with_constants(arm(2))
    motion = swing(robot, 1, seconds=3.0)
    still = replace(motion, dq=np.where(motion.time[:, None] < 1.0, motion.dq, 0.0))
    torque = np.full(still.dq.shape, 20.0)
    listed = ["mechanical_power", "standby_power", "copper_loss", "inverter_loss"]
    without, braked = Stack(robot, listed), Stack(robot, [*listed, HoldingBrakes(delay=0.5)])
    assert without.drives_on(still) is None
    on = braked.drives_on(still).astype(bool)
    assert on.any() and not on[still.time > 1.6].any()
    heat = [effect.electrical_loss and term.joint is not None for effect, term in without.power_terms]
    free, held = without.power_columns(still, torque), braked.power_columns(still, torque)[:, :-1]
    assert np.array_equal(held[on], free[on])
    assert not held[~on][:, heat].any() and free[~on][:, heat].all()
    assert np.array_equal(held[~on][:, np.invert(heat)], free[~on][:, np.invert(heat)])


def test_brakes_open_before_a_motion_and_nobody_knows_power_while_they_switch() -> None:
    motion = swing(with_constants(arm(2)), 1, seconds=6.0)
    moves = (motion.time >= 2.0) & (motion.time < 3.0)
    still = replace(motion, dq=np.where(moves[:, None], 1.0, 0.0) * np.ones(2))
    stack = Stack(arm(2), ["standby_power", HoldingBrakes(delay=0.5, lead=0.2)])
    on, near = stack.drives_on(still) > 0, stack.switching(still)
    assert still.time[on][[0, -1]] == pytest.approx([1.8, 3.5], abs=0.02)
    for opens in (1.8, 3.5):
        assert near[np.abs(still.time - opens) < 0.08].all()
    assert not near[np.abs(still.time[:, None] - [1.8, 3.5]).min(axis=1) > 0.12].any()
    parts = [stack.switching(still.part(at, at + 70)) for at in range(0, len(still.time), 70)]
    assert np.array_equal(np.concatenate(parts), near)
    assert Stack(arm(2), ["standby_power"]).switching(still) is None


def test_no_more_than_what_joints_give_back_is_burnt() -> None:
    """A log that shows half as much again, as of a loss that the twin lacks, tells that nothing is returned."""
    robot = with_constants(arm(3))
    logged = []
    for seed in range(3):
        shown = measure(robot, swing(robot, seed, seconds=20.0), 0.5, seed=seed)
        given_back = np.maximum(truth(robot)["P0"] - shown.power, 0.0)
        logged.append(replace(shown, power=shown.power + 1.5 * given_back))
    twin = identify(robot, logged, (*BASELINE, "copper_loss", "no_regeneration"))
    (burnt,) = (one for one in twin.parameters if one.effect == "no_regeneration")
    (returned,) = twin.quantities
    assert (burnt.value, burnt.upper) == (1.0, 1.0)
    assert (returned.value, returned.lower) == (0.0, 0.0)
    assert 0.0 < returned.upper < 1.0
