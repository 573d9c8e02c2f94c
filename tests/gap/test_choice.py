"""The twin that nobody chose effects for."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.synthetic import arm, as_run, measure, swing, with_constants

from irtwin.effects.catalogue import BASELINE
from irtwin.gap.choice import begin, identified
from irtwin.signals.conditioning import condition
from irtwin.signals.log import DataSet
from irtwin.twin.validate import validate

ROBOT = arm(2)
KT, GAIN = 8.0, 1.3  # N m/A; of a torque constant


def logged(power=None, torque=None, **said):
    """A data set of six runs, and its motions; what the meter and the drives show is changed by functions."""
    robot = with_constants(ROBOT, KT)
    runs = []
    for seed in range(6):
        shown = measure(robot, swing(robot, seed, seconds=10.0), noise=0.2, seed=seed)
        shown = replace(shown, current=None, power=power(shown) if power else shown.power)
        runs.append(as_run(replace(shown, torque=torque(shown.torque) if torque else shown.torque)))
    data = replace(DataSet(Path("arm"), robot, tuple(runs), None, None, "dc_bus", False, {}, cutoff=10.0), **said)
    return data, [condition(run, robot, 10.0) for run in data.runs]


def chosen(twin):
    return {one.effect for one in twin.choices if one.chosen}


@pytest.mark.slow
def test_what_the_runs_show_is_chosen_and_worth_something_on_runs_left_out():
    data, motions = logged()
    twin = identified(replace(data, runs=data.runs[:4]), motions[:4])
    assert chosen(twin) == {"copper_loss"}
    assert set(twin.effect_ids) == {*BASELINE, "copper_loss"}
    (copper,) = (one for one in twin.choices if one.chosen)
    assert copper.probability > 0.9 and copper.unit == "W"
    assert copper.rmse_without > 3 * copper.rmse_with
    assert copper.energy_error_without > 5 * copper.energy_error_with
    before = identified(replace(data, effects=BASELINE), motions[:4])
    errors = [[fit.energy_error for fit in validate(one, motions[4:])] for one in (before, twin)]
    assert max(errors[1]) < 0.3 < max(errors[0])


@pytest.mark.slow
def test_a_meter_that_is_out_of_scale_is_no_effect_of_the_robot():
    data, motions = logged(power=lambda shown: 1.1 * shown.power)
    twin = identified(data, motions)
    assert "meter_gain" not in twin.effect_ids


def test_effects_that_are_named_are_taken_as_they_are():
    data, motions = logged(effects=("rigid_body", "coulomb_friction"))
    twin = identified(data, motions)
    assert twin.effect_ids == ("rigid_body", "coulomb_friction")
    assert twin.choices == ()


def test_what_the_data_sheet_says_needs_no_proof():
    plates = tuple(replace(joint, winding_resistance=0.5) for joint in ROBOT.joints)
    assert begin(ROBOT) == BASELINE
    assert begin(replace(ROBOT, joints=plates)) == (*BASELINE, "copper_loss")


def test_runs_that_show_nothing_leave_the_effects_of_every_robot():
    data, motions = logged()
    short = replace(data, runs=tuple(replace(run, signals=run.signals.rows(np.arange(60))) for run in data.runs[:1]))
    twin = identified(short, motions)
    assert twin.effect_ids == BASELINE and twin.choices == ()
