"""Numbers of an arm whose torque gives out, fitted by what the whole of it does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests import servo_arm

from irtwin.simulator.alone import alone
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.fit import unjudged
from irtwin.simulator.play import each
from irtwin.simulator.refined import refined
from irtwin.simulator.servos import NAMES

pytestmark = pytest.mark.slow
LIMIT, FRICTION = NAMES.index("torque_limit"), NAMES.index("friction")


def found(tmp_path, robots, begun, differs):
    """Return what is refined of numbers that are `begun` beside those of a robot."""
    told = {name: servo_arm.swings(6, seed) for name, seed in (("a", 1), ("b", 2))}
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, told, servo_arm.STOPPED))
    true, near = servo_arm.changed(own, **robots), servo_arm.changed(own, **begun)
    runs = servo_arm.played(data_set, own, true).runs
    fit = unjudged(alone(own, [one for run in runs for one in each(run, 1.2, 4)], 0.005))
    fit = replace(fit, floor=np.full((1, 2), 1e-3), certainty=np.full((1, 2), 50.0))
    marked = np.zeros(near.shape, dtype=bool)
    for place in differs:
        marked[place] = True
    interval, odds = np.stack([near, near]), np.where(marked, 5.0, -np.inf)
    played = fit.played(own.chart(near))
    return true, refined(DifferingNumbers(fit, played, fit.slopes(played), marked, odds, interval))


def test_a_limit_is_the_robots_and_what_made_up_for_it_is_given_back(tmp_path):
    begun = {"torque_limit": (0.6, 30 * np.pi), "friction": (0.07, 0.05)}
    robot = {"torque_limit": (0.52, 30 * np.pi)}
    true, better = found(tmp_path, robot, begun, [(LIMIT, 0), (FRICTION, 0)])
    assert np.argwhere(better.differs).tolist() == [[LIMIT, 0]]
    assert better.numbers[LIMIT, 0] == pytest.approx(0.52, rel=0.01)
    assert better.interval[0, LIMIT, 0] < 0.52 < better.interval[1, LIMIT, 0]
    assert better.numbers[FRICTION, 0] == pytest.approx(true[FRICTION, 0])
    assert np.isfinite(better.odds).tolist() == better.differs.tolist()
    np.testing.assert_allclose(better.without(np.arange(8) < 2)[LIMIT, 0], 0.52, rtol=0.05)


def test_all_is_given_back_where_nothing_differs(tmp_path):
    true, better = found(tmp_path, {}, {"friction": (0.052, 0.05)}, [(FRICTION, 0)])
    assert not better.differs.any()
    np.testing.assert_allclose(better.numbers, true)
    np.testing.assert_allclose(better.interval, np.stack([true, true]))


def test_what_only_bends_a_fall_is_given_back_for_the_limit_alone(tmp_path):
    begun = {"torque_limit": (0.5, 30 * np.pi), "damping": (0.3, 0.7), "delay": (0.05, 0.0), "spring": (0.4, 0.0)}
    robot = {"torque_limit": (0.52, 30 * np.pi)}
    rows = [LIMIT, *(NAMES.index(name) for name in ("damping", "delay", "spring"))]
    _, better = found(tmp_path, robot, begun, [(row, 0) for row in rows])
    assert np.argwhere(better.differs).tolist() == [[LIMIT, 0]]
    assert better.numbers[LIMIT, 0] == pytest.approx(0.52, rel=3e-3)
