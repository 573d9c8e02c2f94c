"""Where the load of a joint hangs, by gravity: far from where the URDF has it, it is another robot's."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.check.test_check import ROBOT, Change, healthy, one, spoilt
from tests.synthetic import heavier

from irtwin.check.check import check
from irtwin.check.gravity import gravity_findings
from irtwin.check.moving import moving
from irtwin.signals.channels import Signals
from irtwin.signals.finding import LogFinding
from irtwin.signals.log import DataSet


def said(data_set: DataSet) -> list[LogFinding]:
    return gravity_findings(data_set.robot, moving(data_set))


def counted_from(joint: int, zero: float) -> Change:
    return one("q", joint, lambda q: q + zero)


@pytest.mark.parametrize(("joint", "turned"), [(1, 1.2), (2, -1.6), (2, 2.5)])
def test_a_load_that_hangs_elsewhere_is_of_another_robot(joint: int, turned: float) -> None:
    (finding,) = said(spoilt(healthy(), counted_from(joint, turned)))
    assert (finding.fault, finding.channel, finding.stops) == ("other_robot", "robot.urdf", True)
    named = (joint, 2)  # the zero of a joint is that of those beyond it, about the same axis
    assert any(f"gravity turns joint_{each + 1} as if its load hung" in finding.say for each in named)
    assert finding.evidence["turned_deg"] == pytest.approx(np.rad2deg(abs(turned)), abs=5)


def test_the_check_says_so_where_free_bodies_explain_the_torques() -> None:
    (finding,) = check(spoilt(healthy(), counted_from(2, -1.6))).findings
    assert "which no masses explain" in finding.say


def balanced(angle: Callable[[np.ndarray], np.ndarray]) -> DataSet:
    """The log of an arm whose second joint a spring holds more than gravity does, by an angle of positions (N, n)."""

    def change(signals: Signals) -> Signals:
        torque = signals.torque.copy()
        torque[:, 1] += 2 * np.ptp(torque[:, 1]) * np.sin(angle(signals.q))
        return replace(signals, torque=torque)

    return spoilt(healthy(), change)


def test_other_masses_a_balancer_a_zero_that_is_off_and_a_sign_are_of_this_robot() -> None:
    assert said(replace(healthy(), robot=heavier(ROBOT, 0.4, 3.0, 1.0, 0.3))) == []
    assert said(balanced(lambda q: q[:, 1] + 0.7)) == []
    assert said(spoilt(healthy(), counted_from(2, 0.1))) == []
    assert said(spoilt(healthy(), one("torque", 2, np.negative))) == []  # of this robot, too


def test_a_load_further_out_that_hangs_as_it_should_speaks_for_those_before() -> None:
    """What the second joint shows by itself is a load that hangs elsewhere; the third's torque is right."""
    assert said(balanced(lambda q: q[:, 1] + q[:, 2] + 1.0)) == []


def test_what_gravity_does_not_turn_says_nothing() -> None:
    still = spoilt(healthy(), lambda signals: replace(signals, q=np.zeros_like(signals.q)))
    assert said(still) == []
    for_nothing = spoilt(healthy(), lambda signals: replace(signals, torque=np.ones_like(signals.q)))
    assert said(for_nothing) == []
