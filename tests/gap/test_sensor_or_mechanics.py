"""Whether what is wrong in torque is mechanical or lies in its measurement, as power tells."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, measure, swing, with_torque

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.gap.diagnosis import diagnose

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_experiment")]

ROBOT = arm(2)
KNOWN = catalogue()
SIDES = {"torque": "mechanical", "measurement": "sensor"}


def logged(real=None, late=0.0):
    """Six runs in which joint 1 has a `real` torque more, and its sensor is `late` by some seconds."""
    made = []
    for k in range(6):
        motion = replace(swing(ROBOT, k // 2, seconds=10.0), run=f"run_{k}")
        more = np.zeros_like(motion.dq)
        if real is not None:
            more[:, 0] = real(motion)
        shown = with_torque(ROBOT, measure(ROBOT, motion, noise=0.3, seed=k), more)
        shown.torque[:, 0] = np.interp(motion.time - late, motion.time, shown.torque[:, 0])
        made.append(replace(as_run(shown), repeat_of=f"run_{k - 1}" if k % 2 else None))
    return data_set(ROBOT, made, (*BASELINE, "copper_loss"))


@pytest.mark.parametrize(
    ("made", "said"),
    [
        ({"real": lambda m: 4 * np.sign(m.dq[:, 0]) * np.exp(-np.abs(m.dq[:, 0]) / 0.1)}, "mechanical"),
        pytest.param(
            {"real": lambda m: 3 * np.cos(4 * m.q[:, 0]) * np.sign(m.dq[:, 0])}, "mechanical", marks=pytest.mark.nightly
        ),
        ({"late": 0.05}, "sensor"),
    ],
)
def test_power_tells_of_what_kind_a_cause_is(made, said):
    document = diagnose(logged(**made)).to_json()
    first = document["causes"][0]
    assert first["joints"] == ["joint_1"]
    assert {SIDES[KNOWN[one].channel] for one in (first["effect"], *first["indistinguishable_from"])} == {said}
    power = document["shrink"]["power_rmse"]
    assert power["before"] > 1.2 * power["after"]  # the twin's torque was wrong, and so was what it takes
