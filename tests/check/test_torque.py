"""Signs of torques that are told, and what is said of those that are not."""

from __future__ import annotations

import numpy as np
import pytest
from tests.check.test_check import healthy, one, spoilt

from irtwin.check.moving import moving
from irtwin.check.torque import torque_findings
from irtwin.signals.log import DataSet


def reversed_(joints: list[int], noisy: int) -> DataSet:
    data_set = healthy()
    for joint in joints:
        data_set = spoilt(data_set, one("torque", joint, np.negative))
    rng = np.random.default_rng(0)
    return spoilt(
        data_set, one("torque", noisy, lambda torque: torque + 5 * np.ptp(torque) * rng.normal(size=len(torque)))
    )


@pytest.mark.parametrize(("joints", "asked"), [([0, 1, 2, 3], True), ([0, 1], False)])
def test_where_all_that_is_told_is_reversed_what_is_not_told_is_named(joints: list[int], asked: bool) -> None:
    data_set = reversed_(joints, noisy=3)
    *others, last = torque_findings(data_set.robot, moving(data_set))
    named = "that of tau_joint_4 this motion does not tell: change it too if all are reversed"
    assert {each.fault for each in (*others, last)} == {"sign"}
    assert (named in last.say, any(named in each.say for each in others)) == (asked, False)
