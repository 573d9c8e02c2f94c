"""Numbers of an arm whose torque gives out, or whose joint is soft, fitted by what the whole of it does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests import servo_arm

from irtwin.simulator.alone import alone
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.fit import unjudged
from irtwin.simulator.play import each
from irtwin.simulator.refined import refined, softened
from irtwin.simulator.servos import NAMES, SOFT

LIMIT, FRICTION, STIFFNESS = (NAMES.index(name) for name in ("torque_limit", "friction", "stiffness"))


def chosen(folder, robots, begun, text=servo_arm.MODEL, noise=3e-4, seconds=3.0):
    """Return an arm, and numbers that were chosen for a robot of others: those that are `begun` differ."""
    told = {name: servo_arm.swings(6, seed) for name, seed in (("a", 1), ("b", 2))}
    data_set, _, own = servo_arm.read(*servo_arm.write(folder, told, text))
    numbers = servo_arm.changed(own, **begun)
    runs = servo_arm.played(data_set, own, servo_arm.changed(own, **robots), noise).runs
    fit = unjudged(alone(own, [one for run in runs for one in each(run, seconds, 4)], 0.005))
    fit = replace(fit, floor=np.full((1, 2), noise), certainty=np.full((1, 2), 75.0))
    differs, played = numbers != own.numbers, fit.rolled(own.chart(numbers))
    odds = np.where(differs, 5.0, -np.inf)
    return own, DifferingNumbers(fit, played, fit.slopes(played), differs, odds, np.stack([numbers, numbers]))


def found(folder, robots, begun):
    """Return the robot's numbers, and what is refined of those that are begun, of an arm that falls to its stops."""
    own, before = chosen(folder, robots, begun, servo_arm.STOPPED, 1e-3, 1.2)
    return servo_arm.changed(own, **robots), refined(before)


@pytest.mark.slow
def test_a_limit_is_the_robots_and_what_made_up_for_it_is_given_back(tmp_path):
    begun = {"torque_limit": (0.6, 30 * np.pi), "friction": (0.07, 0.05)}
    true, better = found(tmp_path, {"torque_limit": (0.52, 30 * np.pi)}, begun)
    assert np.argwhere(better.differs).tolist() == [[LIMIT, 0]]
    assert better.numbers[LIMIT, 0] == pytest.approx(0.52, rel=0.01)
    assert better.interval[0, LIMIT, 0] < 0.52 < better.interval[1, LIMIT, 0]
    assert better.numbers[FRICTION, 0] == pytest.approx(true[FRICTION, 0])
    assert np.isfinite(better.odds).tolist() == better.differs.tolist()
    np.testing.assert_allclose(better.without(np.arange(8) < 2)[LIMIT, 0], 0.52, rtol=0.05)


@pytest.mark.slow
def test_all_is_given_back_where_nothing_differs(tmp_path):
    true, better = found(tmp_path, {}, {"friction": (0.052, 0.05)})
    assert not better.differs.any()
    np.testing.assert_allclose(better.numbers, true)
    np.testing.assert_allclose(better.interval, np.stack([true, true]))


@pytest.mark.slow
def test_what_only_bends_a_fall_is_given_back_for_the_limit_alone(tmp_path):
    begun = {"torque_limit": (0.5, 30 * np.pi), "damping": (0.3, 0.7), "delay": (0.05, 0.0), "spring": (0.4, 0.0)}
    _, better = found(tmp_path, {"torque_limit": (0.52, 30 * np.pi)}, begun)
    assert np.argwhere(better.differs).tolist() == [[LIMIT, 0]]
    assert better.numbers[LIMIT, 0] == pytest.approx(0.52, rel=3e-3)


@pytest.mark.slow
@pytest.mark.parametrize("begun", [{}, {"stiffness": (19.0, 15.0)}])
@pytest.mark.parametrize("row", SOFT)
def test_a_soft_joint_is_found_in_place_of_what_stands_for_it(tmp_path, row, begun):
    soft = 0.02
    own, before = chosen(tmp_path, {NAMES[row]: (soft, 0.0)}, begun)
    better = softened(before)
    assert np.argwhere(better.differs).tolist() == [[row, 0]]
    assert better.interval[0, row, 0] < soft < better.interval[1, row, 0]
    assert better.numbers[row, 0] == pytest.approx(soft, rel=0.2)
    assert better.odds[row, 0] > 0
    assert better.numbers[STIFFNESS, 0] == pytest.approx(own.numbers[STIFFNESS, 0])


@pytest.mark.parametrize("robots", [{}, {"stiffness": (19.0, 15.0)}])
def test_a_robot_that_is_not_soft_keeps_its_numbers(tmp_path, robots):
    _, before = chosen(tmp_path, robots, robots)
    assert softened(before) is before
