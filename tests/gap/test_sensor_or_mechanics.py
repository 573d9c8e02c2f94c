"""Whether what is wrong in torque is mechanical or lies in its measurement, as power tells."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.synthetic import arm, as_run, measure, swing, truth

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.gap.diagnosis import diagnose
from irtwin.signals.log import DataSet

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_experiment")]

ROBOT = arm(2)
KNOWN = catalogue()
WITH_LOSS = (*BASELINE, "copper_loss")
SIDES = {"torque": "mechanical", "measurement": "sensor"}


def data_set(real=None, late=0.0):
    """Six runs in which joint 1 has a `real` torque more, and its sensor is `late` by some seconds."""
    made = []
    for k in range(6):
        motion = replace(swing(ROBOT, k // 2, seconds=10.0), run=f"run_{k}")
        plain = measure(ROBOT, motion, noise=0.3, seed=k)
        more = np.zeros_like(motion.dq)
        if real is not None:
            more[:, 0] = real(motion)
        loss = truth(ROBOT)["R"] / 8.0**2 * ((2 * plain.current * 8.0 + more) * more)
        power = plain.power + (more * motion.dq + loss).sum(axis=1)
        torque = plain.torque + more
        torque[:, 0] = np.interp(motion.time - late, motion.time, torque[:, 0])
        run = as_run(replace(plain, current=None, torque=torque, power=power))
        made.append(replace(run, repeat_of=f"run_{k - 1}" if k % 2 else None))
    return DataSet(Path("arm"), ROBOT, tuple(made), WITH_LOSS, None, "mains", True, {})


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
    document = diagnose(data_set(**made)).to_json()
    first = document["causes"][0]
    assert first["joints"] == ["joint_1"]
    assert {SIDES[KNOWN[one].channel] for one in (first["effect"], *first["indistinguishable_from"])} == {said}
    power = document["shrink"]["power_rmse"]
    assert power["before"] > 1.2 * power["after"]  # the twin's torque was wrong, and so was what it takes
