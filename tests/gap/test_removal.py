"""Whole diagnoses of arms in which something does not repeat: a torque that swings, a load that switches."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.gap.test_diagnosis import WITH_LOSS, data_set, runs, valid

from irtwin.gap.diagnosis import diagnose

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_experiment")]


def with_signal(made, name, added):
    """Runs with more in one signal, (N, ...), by the run's number and its clock."""
    changed = []
    for number, run in enumerate(made):
        values = getattr(run.signals, name)
        more = added(number, run.signals.time).reshape(len(values), *(1,) * (values.ndim - 1))
        if name == "torque":
            more = more * np.eye(values.shape[1])[1]
        changed.append(replace(run, signals=replace(run.signals, **{name: values + more})))
    return changed


def test_a_torque_that_swings_is_the_cause_and_what_is_left_is_noise():
    made = with_signal(runs(count=2), "torque", lambda k, t: 18.0 * np.sin(2 * np.pi * 2.9 * t + 2.0 * k))
    diagnosis = diagnose(data_set(made, effects=WITH_LOSS))
    document = valid(diagnosis)
    assert diagnosis.verdict == "attributed"
    (cause,) = document["causes"]
    assert cause["id"] == "periodic_disturbance@joint_2" and cause["confidence"] > 0.9
    said = {one["name"]: one for one in cause["parameters"]}
    assert said["f"]["value"] == pytest.approx(2.9, abs=0.005)
    assert said["A"]["value"] == pytest.approx(18.0, abs=0.1)
    (located,) = document["not_repeating"]
    assert located["explained_by"] == cause["id"] and located["kind"] == "line"
    size = document["gap"]["torque"]["joint_2"]
    assert size["rmse"] == pytest.approx(18.0 / np.sqrt(2), rel=0.05)
    assert size["noise_floor"] < 0.3 and size["sensor_noise"] < 0.3  # what is removed is in neither
    assert document["shrink"]["closed_fraction"]["value"] > 0.99
    (closed,) = document["shrink"]["by_cause"]
    assert closed["rmse_before"][1] > 10 and closed["rmse_with_all"][1] < 0.3


def test_a_load_that_switches_is_the_cause_and_the_energy_is_right_without_it():
    made = with_signal(runs(count=2), "power", lambda k, t: 60.0 * ((t / 3.0 + 0.4 * k) % 1 < 0.3))
    diagnosis = diagnose(data_set(made, effects=WITH_LOSS))
    document = valid(diagnosis)
    assert diagnosis.verdict == "attributed"
    (cause,) = document["causes"]
    assert cause["id"] == "switching_load"
    said = {one["name"]: one["value"] for one in cause["parameters"]}
    assert said["P"] == pytest.approx(60.0, rel=0.1) and said["duty"] == pytest.approx(0.3, abs=0.05)
    assert document["gap"]["power"]["rmse"] > 20
    standby = next(one for one in diagnosis.twin.parameters if one.name == "P0")
    assert standby.value == pytest.approx(120.0, abs=3.0)


def test_an_offset_between_runs_is_located_only():
    made = with_signal(runs(count=2), "torque", lambda k, t: 4.0 * k + 0 * t)
    diagnosis = diagnose(data_set(made, effects=WITH_LOSS))
    assert diagnosis.verdict == "unexplained"
    assert [(one.kind, one.joint, one.explained_by) for one in diagnosis.document.not_repeating] == [
        ("offset", "joint_2", None)
    ]
