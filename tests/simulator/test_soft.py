"""Soft joints told by the whole model."""

from dataclasses import replace

import numpy as np
import pytest
from tests import servo_arm

from irtwin.simulator.alone import alone
from irtwin.simulator.choice import DifferingNumbers
from irtwin.simulator.fit import unjudged
from irtwin.simulator.play import each
from irtwin.simulator.refined import softened
from irtwin.simulator.servos import NAMES, SOFT

NOISE = 3e-4
STIFFNESS = NAMES.index("stiffness")


def chosen(tmp_path, robots, begun):
    """Return an arm, and numbers that were chosen for one that is another: those that are `begun` differ."""
    told = {name: servo_arm.swings(6, seed) for name, seed in (("a", 1), ("b", 2))}
    data_set, _, own = servo_arm.read(*servo_arm.write(tmp_path, told))
    numbers = servo_arm.changed(own, **begun)
    runs = servo_arm.played(data_set, own, servo_arm.changed(own, **robots), noise=NOISE).runs
    fit = unjudged(alone(own, [one for run in runs for one in each(run, 3.0, 2)], 0.005))
    fit = replace(fit, floor=np.full((1, 2), NOISE), certainty=np.full((1, 2), 100.0))
    differs, played = numbers != own.numbers, fit.rolled(own.chart(numbers))
    odds = np.where(differs, 5.0, -np.inf)
    return own, DifferingNumbers(fit, played, fit.slopes(played), differs, odds, np.stack([numbers, numbers]))


@pytest.mark.slow
@pytest.mark.parametrize("begun", [{}, {"stiffness": (19.0, 15.0)}])
@pytest.mark.parametrize("row", SOFT)
def test_a_soft_joint_is_found_in_place_of_what_stands_for_it(tmp_path, row, begun):
    soft = 0.02
    own, before = chosen(tmp_path, {NAMES[row]: (soft, 0.0)}, begun)
    found = softened(before)
    assert np.argwhere(found.differs).tolist() == [[row, 0]]
    assert found.interval[0, row, 0] < soft < found.interval[1, row, 0]
    assert found.numbers[row, 0] == pytest.approx(soft, rel=0.2)
    assert found.odds[row, 0] > 0
    assert found.numbers[STIFFNESS, 0] == pytest.approx(own.numbers[STIFFNESS, 0])


@pytest.mark.parametrize("robots", [{}, {"stiffness": (19.0, 15.0)}])
def test_a_robot_that_is_not_soft_keeps_its_numbers(tmp_path, robots):
    _, before = chosen(tmp_path, robots, robots)
    assert softened(before) is before
