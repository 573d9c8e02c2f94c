"""States of the supply in a run."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing, truth

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.supply import HoldingBrakes
from irtwin.signals.filter import lagged
from irtwin.signals.motion import Motion, standstill
from irtwin.twin.identify import identify
from irtwin.twin.supply_states import supply_states

ROBOT = arm(2)
REST, BRAKES, DELAY = 6.0, 30.0, 1.0  # s, W, s


def run(seed: int, brakes: float = 0.0):
    """A motion, then rest at which brakes, if any, close after a second and carry the links."""
    moving = swing(ROBOT, seed, seconds=10.0)
    after = moving.time[-1] + np.arange(1, 1 + round(REST * moving.rate)) / moving.rate
    rest = np.zeros((len(after), 2))
    whole = replace(
        moving,
        time=np.concatenate([moving.time, after]),
        q=np.concatenate([moving.q, rest + moving.q[-1]]),
        dq=np.concatenate([moving.dq, rest]),
        ddq=np.concatenate([moving.ddq, rest]),
    )
    shown = measure(ROBOT, whole, 0.2, seed=seed)
    released = HoldingBrakes(delay=DELAY).columns(ROBOT, whole)[:, 0]
    heat = (truth(ROBOT)["R"] * shown.current**2).sum(axis=1)
    return replace(shown, power=shown.power + brakes * released - (heat * (1 - released) if brakes else 0.0))


def states(twin, motion):
    return {state.name: state for state in supply_states(twin, motion)}


def test_drives_hold_a_robot_without_brakes_at_rest():
    twin = identify(ROBOT, [run(1), run(2)])
    found = states(twin, run(3))
    assert set(found) == {"moving", "drives on at rest"}
    assert found["drives on at rest"].seconds == pytest.approx(REST, abs=0.5)
    assert sum(state.seconds for state in found.values()) == pytest.approx(run(3).time[-1])


def test_brakes_close_after_a_motion_and_take_less():
    twin = identify(ROBOT, [run(1, BRAKES), run(2, BRAKES)], [*BASELINE, "copper_loss", HoldingBrakes(delay=DELAY)])
    found = states(twin, run(3, BRAKES))
    assert found["brakes closed"].seconds == pytest.approx(REST - DELAY, abs=0.5)
    held, closed = found["drives on at rest"], found["brakes closed"]
    assert held.logged - closed.logged == pytest.approx(BRAKES, abs=3.0)
    assert held.modelled.value - closed.modelled.value == pytest.approx(BRAKES, abs=3.0)
    assert not closed.differs


def test_a_rest_that_takes_other_than_the_twin_says_differs():
    twin, motion = identify(ROBOT, [run(1), run(2)]), run(3)
    other = states(twin, replace(motion, power=motion.power + 25.0))
    assert other["drives on at rest"].differs
    assert not states(twin, replace(motion, power=None))["drives on at rest"].differs


def test_a_supply_that_is_off_takes_next_to_nothing():
    twin, motion = identify(ROBOT, [run(1), run(2)]), run(3)
    power = np.where(motion.time > motion.time[-1] - 2.0, 1.0, motion.power)
    off = states(twin, replace(motion, power=power))["off"]
    assert off.seconds == pytest.approx(2.0, abs=0.1) and off.logged == pytest.approx(1.0)
    assert off.differs


def test_a_joint_that_slips_at_rest_opens_no_brake():
    whole = run(1, BRAKES)
    closed = HoldingBrakes(delay=DELAY).columns(ROBOT, whole)[:, 0]
    at = int(np.flatnonzero(standstill(whole) & (closed == 0))[5])
    slip = whole.dq.copy()
    slip[at : at + round(0.1 * whole.rate), 0] = 0.05
    slipped = replace(whole, dq=slip)
    assert (HoldingBrakes(delay=DELAY).columns(ROBOT, slipped)[:, 0] == closed).all()
    assert (standstill(slipped) == standstill(whole)).all()


def slow_coils(seed: int):
    """Rest, a motion, rest: brakes open 0.1 s before it, as no shape that is tried, and their current rises slowly."""
    moving = run(seed)
    count = round(REST * moving.rate)
    before = {name: np.repeat(getattr(moving, name)[:1], count, axis=0) for name in ("q", "dq", "ddq")}
    states = {name: np.concatenate([rest * (name == "q"), getattr(moving, name)]) for name, rest in before.items()}
    bare = Motion(np.arange(count + len(moving.time)) / moving.rate, **states, run=moving.run)
    shown = measure(ROBOT, bare, 0.2, seed=seed)
    on = HoldingBrakes(delay=DELAY, lead=0.1).columns(ROBOT, bare)[:, 0]
    heat = (truth(ROBOT)["R"] * shown.current**2).sum(axis=1)
    coils = lagged(on, np.exp(-1 / (0.03 * bare.rate)), before=0.0)
    return replace(shown, power=shown.power + BRAKES * coils - heat * (1 - on))


@pytest.mark.slow
def test_brakes_whose_coils_take_a_while_leave_the_standby_as_it_is():
    twin = identify(ROBOT, [slow_coils(seed) for seed in range(4)], [*BASELINE, "copper_loss", "holding_brakes"])
    (brakes,) = (effect for effect in twin.stack.effects if effect.id == "holding_brakes")
    assert brakes.lead == pytest.approx(0.08, abs=0.04) and brakes.delay == pytest.approx(DELAY, abs=0.1)
    standby = next(one for one in twin.parameters if one.effect == "standby_power")
    assert standby.lower < truth(ROBOT)["P0"] < standby.upper < standby.lower + 2.0
