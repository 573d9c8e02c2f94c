from __future__ import annotations

import json
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, measure, swing

from blind.baselines import THRESHOLD, answers, majority, thresholded
from blind.compare import table
from irtwin.gap.data.case import case_of
from irtwin.gap.thresholds import DEFAULT

pytestmark = pytest.mark.slow

ROBOT = arm(2)
NAMES = ("bic_greedy", "f_test", "e_sindy")
STICKS = ("stribeck_friction", "joint_2")


def logged(added):
    """Runs of an arm whose twin lacks what is added to its torque, in N m, and what that takes of power."""
    runs = []
    for seed in range(6):
        motion = replace(swing(ROBOT, seed // 2, seconds=8.0), run=f"run_{seed}")
        shown, extra = measure(ROBOT, motion, noise=0.3, seed=seed), added(motion)
        power = shown.power + (extra * motion.dq).sum(axis=1)
        run = as_run(replace(shown, torque=shown.torque + extra, power=power, current=None))
        runs.append(replace(run, repeat_of=f"run_{seed - 1}" if seed % 2 else None))
    return data_set(ROBOT, runs)


def sticking(motion):
    added = np.zeros_like(motion.dq)
    added[:, 1] = 4 * np.sign(motion.dq[:, 1]) * np.exp(-np.abs(motion.dq[:, 1]) / 0.1)
    return added


@pytest.fixture(scope="module")
def said():
    return answers(case_of(logged(sticking), (), DEFAULT), NAMES)


def family(cause):
    return {cause["effect"], *cause["indistinguishable_from"]}


@pytest.mark.parametrize("name", NAMES)
def test_a_missing_friction_is_named_with_its_joint(said, name):
    torque = [cause for cause in said[name]["causes"] if "stribeck_friction" in family(cause)]
    assert "joint_2" in torque[0]["joints"]


@pytest.mark.parametrize("name", NAMES)
def test_what_a_baseline_says_has_the_form_of_a_diagnosis(said, name):
    jsonschema = pytest.importorskip("jsonschema")
    schema = json.loads((resources.files("irtwin.gap") / "diagnosis.schema.json").read_text())
    jsonschema.validate(said[name], schema)
    assert said[name]["verdict"] in ("attributed", "ambiguous")


@pytest.mark.parametrize("name", NAMES)
def test_power_is_judged_on_the_torque_that_was_explained(said, name):
    named = set().union(*(family(cause) for cause in said[name]["causes"]))
    assert "copper_loss" in named, "the windings' loss, which the default twin lacks"


def test_thresholding_keeps_what_adds_and_drops_the_rest():
    rng = np.random.default_rng(0)
    columns = rng.standard_normal((5000, 6))
    measured = columns @ [0.0, 3.0, 0.0, -1.0, 0.05, 0.0] + rng.standard_normal(5000)
    rows = np.column_stack([columns, measured])
    share = thresholded(rows.T @ rows)
    assert np.flatnonzero(share).tolist() == [1, 3]
    assert share[1] == pytest.approx(9 / 11, rel=0.05)
    assert share[share > 0].min() >= THRESHOLD


def test_the_majority_is_the_commonest_effect_of_singles():
    def label(kind, effect, scope="missing"):
        return {"kind": kind, "scope": scope, "effects": [{"effect": effect, "joints": ["a1"]}]}

    labels = {
        "1": label("single", "payload"),
        "2": label("single", "backlash", "changed"),
        "3": label("single", "backlash", "changed"),
        "4": label("pair", "payload"),
        "5": label("pair", "payload"),
    }
    said = majority(labels)
    assert (said["effect"], said["scope"], said["joints"]) == ("backlash", "changed", ["a1"])
    assert said["confidence"] == pytest.approx(2 / 3)


def test_ways_stand_side_by_side_on_the_cases_that_all_have_answered():
    truth = {"effect": "backlash", "joints": ["a1"], "gap_over_floor": 3.0, "channel": "torque", "regimes": []}
    label = {"kind": "single", "scope": "missing", "level": 3.0, "robot": "slim7", "effects": [truth]}
    right = {"effect": "backlash", "joints": ["a1"], "scope": "missing", "confidence": 1.0}
    right |= {"indistinguishable_from": []}
    text = table(
        {
            "this": {"1": {"causes": [right], "seconds": 2.0}, "2": {"causes": []}},
            "that": {"1": {"causes": [right | {"effect": "payload"}], "seconds": 1.0}},
        },
        {"1": label, "2": label},
    )
    assert "| 1 cases | aim | this | that |" in text
    assert "| right effect first | >= 95 % | 100 % | 0 % |" in text
    assert "| expected calibration error | <= 0.05 | 0.00 | 1.00 |" in text
