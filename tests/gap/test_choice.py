"""The twin that nobody chose effects for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, measure, swing, with_constants

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.gap.choice import begin, elsewhere, identified
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.validation import split
from irtwin.signals.conditioning import condition
from irtwin.signals.log import read_data_set
from irtwin.twin.validate import validate
from irtwin.workflow import unpack_demo

ROBOT = arm(2)
KT = 8.0  # N m/A


def logged(change=lambda shown: shown, **said):
    """A data set of six runs, and its motions; what meter and drives show is changed by a function."""
    robot = with_constants(ROBOT, KT)
    runs = []
    for seed in range(6):
        shown = measure(robot, swing(robot, seed, seconds=10.0), noise=0.2, seed=seed)
        runs.append(as_run(change(replace(shown, current=None))))
    data = replace(data_set(robot, runs, None, "dc_bus"), **{"simulated": False, "cutoff": 10.0, **said})
    return data, [condition(run, robot, 10.0) for run in data.runs]


def coupled(shown):
    """Joints that drag each other along as they turn."""
    drag = 3.0 * shown.dq[:, ::-1]
    return replace(shown, torque=shown.torque + drag, power=shown.power + (drag * shown.dq).sum(axis=1))


@pytest.mark.slow
def test_what_the_runs_show_is_chosen_and_worth_something_on_runs_left_out():
    data, motions = logged(coupled)
    twin = identified(replace(data, runs=data.runs[:4]), motions[:4])
    assert {*begin(data.runs), "joint_coupling"} <= {*twin.effect_ids}
    (drag,) = (one for one in twin.choices if one.chosen and one.effect == "joint_coupling")
    assert drag.probability > 0.9 and drag.unit == "N m"
    assert drag.rmse_without > 3 * drag.rmse_with
    before = identified(replace(data, effects=BASELINE), motions[:4])
    errors = [[fit.energy_error for fit in validate(one, motions[4:])] for one in (before, twin)]
    assert max(errors[1]) < 0.3 < max(errors[0])


@pytest.mark.slow
def test_a_meter_that_is_out_of_scale_is_no_effect_of_the_robot():
    data, motions = logged(lambda shown: replace(shown, power=1.1 * shown.power))
    twin = identified(data, motions)
    assert "meter_gain" not in twin.effect_ids


def test_effects_that_are_named_are_taken_as_they_are():
    data, motions = logged(effects=("rigid_body", "coulomb_friction"))
    twin = identified(data, motions)
    assert twin.effect_ids == ("rigid_body", "coulomb_friction")
    assert twin.choices == ()


def test_what_some_joints_show_is_in_the_twin_where_others_leave_it_open():
    shown = [catalogue()["stribeck_friction"].on("joint_1"), catalogue()["torque_offset"]]
    left_open = {"stribeck_friction": [("joint_1", 0.5), ("joint_2", 0.3)], "torque_offset": [("joint_2", 0.3)]}
    more = list(elsewhere(shown, {**left_open, "backlash": [("joint_1", 0.9)], "bus_capacitor": [(None, 0.4)]}))
    assert [(one.id, one.joints) for one in more] == [("stribeck_friction", ("joint_2",))]


def test_the_heat_of_every_drive_needs_no_proof_where_power_was_logged():
    runs = logged()[0].runs
    dark = [replace(run, signals=replace(run.signals, power=None)) for run in runs]
    assert begin(runs) == (*BASELINE, "copper_loss", "iron_loss", "inverter_loss")
    assert begin(dark) == BASELINE


def test_oil_that_thins_needs_no_proof_where_joints_were_logged_cold_and_warm():
    run = logged()[0].runs[0]
    rows = len(run.signals.time)
    cold, warm = (replace(run, signals=replace(run.signals, temperature=np.full((rows, 2), t))) for t in (20.0, 40.0))
    assert "temperature_dependent_friction" in begin([cold, warm])
    assert "temperature_dependent_friction" not in begin([cold, cold])


def test_runs_that_show_nothing_leave_the_effects_of_every_robot():
    data, motions = logged()
    short = replace(data, runs=tuple(replace(run, signals=run.signals.rows(np.arange(60))) for run in data.runs[:1]))
    twin = identified(short, motions)
    assert twin.effect_ids == begin(data.runs) and twin.choices == ()


@pytest.mark.nightly
@pytest.mark.slow
def test_the_demos_logs_are_predicted_by_what_its_supply_does(tmp_path):
    """Chopper, capacitor and a meter that lags hide one another: each by itself is less likely than nothing."""
    data = replace(read_data_set(unpack_demo(tmp_path)), effects=None)
    cutoff = cutoff_for(data.robot, data.runs, data.cutoff).hz
    motions = [condition(run, data.robot, cutoff) for run in data.runs]
    parts = split(motions, {run.name: run.repeat_of for run in data.runs if run.repeat_of})
    fitted = {motion.run for motion in parts.fit}
    twin = identified(replace(data, runs=tuple(run for run in data.runs if run.name in fitted)), parts.fit)
    errors = [fit.energy_error for fit in validate(twin, parts.held_out)]
    assert np.mean(errors) < 1.0
    assert max(errors) < 3.0
    (standby,) = (number for number in twin.parameters if number.effect == "standby_power")
    assert standby.lower < 110.0 < standby.upper
