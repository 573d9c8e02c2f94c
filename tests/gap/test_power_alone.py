"""Diagnoses where torque was measured in no run, or in some and power in others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, measure, swing, with_torque

from irtwin.effects.catalogue import BASELINE
from irtwin.gap.diagnosis import diagnose

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_experiment")]

ROBOT = arm(2)
WITH_LOSS = (*BASELINE, "copper_loss")


def runs(shows, role="observed", added=None, first=0, count=6):
    """Runs that show "torque", "power" or both, in turn; `added` gives N m to joint 1's torque."""
    made = []
    for k in range(count):
        motion = replace(swing(ROBOT, first + k // 2, seconds=10.0), run=f"{role}_{first + k}")
        more = np.zeros_like(motion.dq) if added is None else np.outer(added(motion), [1.0, 0])
        shown = with_torque(ROBOT, measure(ROBOT, motion, noise=0.3, seed=first + k), more)
        hidden = dict.fromkeys({"torque", "power"}.difference(shows[k % len(shows)]))
        run = as_run(replace(shown, **hidden))
        made.append(replace(run, role=role, repeat_of=f"{role}_{first + k - 1}" if k % 2 else None))
    return made


def test_power_alone_shows_no_gap_where_there_is_none():
    diagnosis = diagnose(data_set(ROBOT, runs([["power"]]), WITH_LOSS))
    assert diagnosis.verdict == "no_gap"
    document = diagnosis.to_json()
    assert document["gap"].get("torque") is None
    assert document["gap"]["power"]["excess"] < 0.5
    assert document["shrink"]["torque_rmse"] is None and document["shrink"]["power_rmse"] is not None
    assert {"effect": "stribeck_friction", "why": "no torque was measured"} in document["not_testable"]


def test_power_alone_lacks_the_loss_in_the_windings():
    diagnosis = diagnose(data_set(ROBOT, runs([["power"]]), WITH_LOSS), withhold=["copper_loss"])
    channel, cause = diagnosis.causes[0]
    assert channel.name == "power"
    assert "copper_loss" in (cause.effect, *cause.rivals)
    shrink = diagnosis.to_json()["shrink"]
    assert shrink["power_rmse"]["after"] < 0.5 * shrink["power_rmse"]["before"]
    assert "copper_loss" in diagnosis.twin.effect_ids


def test_power_alone_lacks_what_stands_by():
    diagnosis = diagnose(data_set(ROBOT, runs([["power"]]), BASELINE), withhold=["standby_power"])
    assert diagnosis.causes[0][1].effect == "standby_power"


@pytest.mark.nightly
def test_torque_in_some_runs_and_power_in_others():
    split = [["torque"], ["torque"], ["power"], ["power"]]
    grease = [*runs(split, "reference", count=8), *runs(split, added=lambda m: 3 * m.dq[:, 0], first=20, count=8)]
    diagnosis = diagnose(data_set(ROBOT, grease, WITH_LOSS))
    named = {(channel.name, cause.effect, cause.scope, cause.joints) for channel, cause in diagnosis.causes}
    assert named == {("torque", "viscous_friction", "changed", ("joint_1",))}
    power = diagnosis.to_json()["shrink"]["power_rmse"]
    assert power["before"] > 10 * power["after"]  # the friction that torque showed takes it in runs without torque too
    assert (power["after"] / power["noise_floor"]) ** 2 - 1 < 0.5


def test_torque_in_the_reference_runs_alone():
    reference = runs([["torque", "power"]], "reference")
    diagnosis = diagnose(data_set(ROBOT, [*reference, *runs([["power"]], first=20)], WITH_LOSS))
    assert [channel.name for channel in diagnosis.channels] == ["power"]
    assert diagnosis.verdict == "no_gap"


def test_no_gap_is_told_of_power_where_torque_alone_was_measured():
    document = diagnose(data_set(ROBOT, runs([["torque"]]), WITH_LOSS)).to_json()
    assert document["shrink"]["torque_rmse"] is not None and document["shrink"]["power_rmse"] is None
