"""Diagnoses of arms whose missing effect is known."""

from __future__ import annotations

import json
from dataclasses import replace
from importlib import resources

import numpy as np
import pytest
from tests import synthetic
from tests.synthetic import arm, as_run, measure, swing, with_torque

from irtwin.document.curves import Curves
from irtwin.document.document import Document, schema
from irtwin.effects.catalogue import BASELINE
from irtwin.effects.friction import TemperatureDependentFriction
from irtwin.errors import InputError
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.thresholds import DEFAULT

pytestmark = [pytest.mark.slow, pytest.mark.usefixtures("no_experiment")]

ROBOT = arm(2)


def data_set(runs, robot=ROBOT, effects=None):
    return synthetic.data_set(robot, runs, effects)


def runs(count=6, noise=0.3, change=None, role="observed", first=0, robot=ROBOT):
    """Runs of one arm; `change` alters the torque (and so power) of a motion by N m."""
    made = []
    for seed in range(first, first + count):
        motion = replace(swing(robot, seed // 2, seconds=10.0), run=f"{role}_{seed}")
        added = np.zeros_like(motion.dq) if change is None else change(motion)
        run = as_run(with_torque(robot, measure(robot, motion, noise=noise, seed=seed), added))
        made.append(replace(run, role=role, repeat_of=f"{role}_{seed - 1}" if seed % 2 else None))
    return made


def on_joint(joint, function):
    def change(motion):
        added = np.zeros_like(motion.dq)
        added[:, joint] = function(motion)
        return added

    return change


def valid(diagnosis):
    document = diagnosis.to_json()
    contract = json.loads((resources.files("irtwin.gap") / "diagnosis.schema.json").read_text())
    jsonschema = pytest.importorskip("jsonschema")
    jsonschema.validate(document, contract)
    jsonschema.validate(document, schema())
    assert Document.from_json(document) == diagnosis.document
    return document


WITH_LOSS = (*BASELINE, "copper_loss")


@pytest.mark.parametrize("seed", [0, *(pytest.param(seed, marks=pytest.mark.nightly) for seed in (1, 2))])
def test_no_gap_is_found_where_there_is_none(seed):
    diagnosis = diagnose(data_set(runs(first=10 * seed), effects=WITH_LOSS))
    assert diagnosis.verdict == "no_gap"
    assert diagnosis.causes == ()
    assert diagnosis.floor.source == "repeats"


def test_the_shape_of_an_effect_that_the_data_set_names_is_no_gap():
    sticks = on_joint(1, lambda one: 6 * np.sign(one.dq[:, 1]) * np.exp(-((one.dq[:, 1] / 0.2) ** 2)))
    effects = (*WITH_LOSS, "stribeck_friction")
    assert diagnose(data_set(runs(change=sticks), effects=effects)).verdict == "no_gap"


def test_what_two_runs_differ_by_in_the_mean_is_not_blamed_on_an_effect():
    apart = []
    for seed, pose, offset in ((0, -0.8, 2.0), (1, 0.8, -2.0)):  # a tilted base would differ by pose too
        swung = swing(ROBOT, seed, seconds=20.0)
        shown = measure(ROBOT, replace(swung, q=swung.q + pose, run=f"run_{seed}"), noise=0.3, seed=seed)
        apart.append(as_run(replace(shown, torque=shown.torque + offset, power=None, current=None)))
    assert diagnose(data_set(apart)).causes == ()


def test_a_missing_friction_is_named_with_its_joint():
    stribeck = on_joint(1, lambda m: 4 * np.sign(m.dq[:, 1]) * np.exp(-np.abs(m.dq[:, 1]) / 0.1))
    diagnosis = diagnose(data_set(runs(change=stribeck), effects=WITH_LOSS))
    (_, cause), *_ = diagnosis.causes
    assert "stribeck_friction" in (cause.effect, *cause.rivals)
    assert cause.joints == ("joint_2",)
    assert cause.scope == "missing"
    friction = diagnosis.curves.friction
    assert [one.joint for one in friction] == list(ROBOT.joint_names)  # nothing changed: one side
    assert "Fs" in {one.name for one in friction[1].numbers}
    shrink = diagnosis.to_json()["shrink"]
    assert shrink["closed_fraction"]["value"] > 0.8
    assert shrink["torque_rmse"]["after"] < shrink["torque_rmse"]["before"]


def test_a_change_is_named_beside_the_reference_runs():
    grease = on_joint(0, lambda m: 3 * m.dq[:, 0])
    both = [*runs(4, role="reference"), *runs(4, change=grease, first=20)]
    diagnosis = diagnose(data_set(both, effects=WITH_LOSS))
    (_, cause), *_ = diagnosis.causes
    assert (cause.effect, cause.scope, cause.joints) == ("viscous_friction", "changed", ("joint_1",))
    (parameter,) = diagnosis.to_json()["causes"][0]["parameters"]
    assert parameter["value"] == pytest.approx(3.0, rel=0.1)
    assert parameter["interval95"][0] < 3.0 < parameter["interval95"][1]
    sides = [one for one in diagnosis.curves.friction if one.joint == "joint_1"]
    assert [one.role for one in sides] == ["reference", "observed"]
    before, after = (number.value for one in sides for number in one.numbers if number.name == "Fv")
    assert after - before == pytest.approx(3.0, rel=0.1)
    assert [one.joint for one in diagnosis.curves.friction][1:] == list(ROBOT.joint_names)  # one side of the others
    assert Curves.from_json(json.loads(json.dumps(diagnosis.evidence))) == diagnosis.curves


@pytest.mark.nightly
def test_oil_that_thins_otherwise_than_before_is_a_change_which_the_twin_takes():
    def warmth(run):
        return 25.0 + 2 * (int(run.split("_")[1]) % 10)  # degC

    def thins(motion):
        return 8 * motion.dq[:, 1] * (np.exp(-0.02 * (warmth(motion.run) - 38)) - 1)

    def logged(run):
        temperature = np.full(run.signals.q.shape, warmth(run.name))
        return replace(run, signals=replace(run.signals, temperature=temperature))

    both = [*runs(10, role="reference"), *runs(10, change=on_joint(1, thins), first=20)]
    diagnosis = diagnose(data_set([logged(run) for run in both], effects=WITH_LOSS))
    (_, cause), *_ = diagnosis.causes
    assert (cause.effect, cause.scope, cause.joints) == ("temperature_dependent_friction", "changed", ("joint_2",))
    assert TemperatureDependentFriction(joints=("joint_2",)) in diagnosis.twin.effects


@pytest.mark.parametrize("size", [0.0, 0.15])
def test_what_has_no_cause_is_told_beyond_what_reference_runs_leave_over_one_another(size):
    unknown = on_joint(1, lambda m: size * np.sign(np.sin(9 * m.q[:, 0] + 5 * m.q[:, 1])))
    both = [*runs(role="reference"), *runs(change=unknown, first=20)]
    without_power = [replace(run, signals=replace(run.signals, power=None)) for run in both]
    diagnosis = diagnose(data_set(without_power, effects=WITH_LOSS))
    assert diagnosis.causes == ()
    (torque,) = diagnosis.channels
    assert max((torque.fitted[1] / torque.floor) ** 2 - 1) < DEFAULT.criterion.excess
    assert diagnosis.verdict == ("unexplained" if size else "no_gap")
    assert {place.joint for place in diagnosis.document.locations} == ({"joint_2"} if size else set())


def test_withheld_friction_comes_back():
    diagnosis = diagnose(data_set(runs(4), effects=WITH_LOSS), withhold=["coulomb_friction"])
    (_, cause), *_ = diagnosis.causes
    assert cause.effect == "coulomb_friction"
    assert set(cause.joints) == {"joint_1", "joint_2"}
    assert "coulomb_friction" in diagnosis.twin.stack.ids
    document = valid(diagnosis)
    assert document["verdict"] in ("attributed", "ambiguous")
    json.dumps(document, allow_nan=False)


def test_power_lacks_the_loss_in_the_windings_and_a_stated_cutoff_is_that_of_document_and_twin():
    stated = replace(data_set(runs(4), effects=WITH_LOSS), cutoff=7.25)
    diagnosis = diagnose(stated, withhold=["copper_loss"])
    channel, cause = diagnosis.causes[0]
    assert (channel.name, cause.effect) == ("power", "copper_loss")
    assert valid(diagnosis)["cutoff"] == {"hz": 7.25, "stated": True, "why": "stated"}
    assert diagnosis.twin.cutoff == 7.25


def test_an_effect_that_the_search_does_not_know_is_neither_named_nor_a_rival():
    stribeck = on_joint(1, lambda m: 4 * np.sign(m.dq[:, 1]) * np.exp(-np.abs(m.dq[:, 1]) / 0.1))
    diagnosis = diagnose(data_set(runs(4, change=stribeck), effects=WITH_LOSS), unknown=["stribeck_friction"])
    named = {name for _, cause in diagnosis.causes for name in (cause.effect, *cause.rivals)}
    assert "stribeck_friction" not in named
    assert diagnosis.verdict != "no_gap"
    assert diagnosis.locations[0].joint == "joint_2"


def test_one_run_without_power_is_cut_in_time():
    (run, *_) = runs(1, change=on_joint(1, lambda m: 2 * np.sin(8 * m.q[:, 1])))
    run = replace(run, signals=replace(run.signals, power=None))
    diagnosis = diagnose(data_set([run]))
    document = valid(diagnosis)
    assert document["gap"].get("power") is None
    assert {"effect": "copper_loss", "why": "no power was measured"} in document["not_testable"]
    cause, *others = document["causes"]
    assert (cause["joints"], cause["confidence"] > 0.9) == (["joint_2"], True)
    assert all(other["folded_away"] for other in others)


@pytest.mark.nightly
def test_the_same_data_give_the_same_diagnosis():
    made = [diagnose(data_set(runs(4)), withhold=["viscous_friction"]).to_json() for _ in range(2)]
    assert made[0] == made[1]


def test_rigid_bodies_cannot_be_withheld():
    with pytest.raises(InputError, match="rigid bodies cannot be withheld"):
        diagnose(data_set(runs(2)), withhold=["rigid_body"])


def test_nothing_measured():
    (run,) = runs(1)
    bare = replace(run, signals=replace(run.signals, torque=None, power=None))
    with pytest.raises(InputError, match="neither torque nor power was measured in any observed run"):
        diagnose(data_set([bare]))
