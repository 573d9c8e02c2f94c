"""A twin goes into a diagnosis: what it models is no gap, what is new is."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, measure, swing, truth

from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.friction import StribeckFriction
from irtwin.errors import InputError
from irtwin.gap.data.baseline import baseline, said_of_twin
from irtwin.gap.diagnosis import diagnose
from irtwin.twin.files import from_json, to_json
from irtwin.twin.identify import identify

pytestmark = pytest.mark.usefixtures("no_experiment")

ROBOT = arm(2)
OTHERS = {"another count": arm(3), "another joint": arm(2, slides=(1,))}


def logged(first, cable=0.0, grease=1.0):
    """Four runs, two motions twice, of an arm that sticks at joint_2 and whose windings heat.

    A cable may pull at joint_1, N m/rad, and friction be so many times what it was.
    """
    made = []
    for seed in range(first, first + 4):
        motion = replace(swing(ROBOT, (first + seed) // 2, seconds=8.0), run=f"run_{seed}")
        shown = measure(ROBOT, motion, noise=0.3, seed=seed)
        true = truth(ROBOT)
        added = (grease - 1) * (true["Fc"] * np.sign(motion.dq) + true["Fv"] * motion.dq)
        added[:, 0] += cable * motion.q[:, 0]
        added[:, 1] += 4 * np.sign(motion.dq[:, 1]) * np.exp(-np.abs(motion.dq[:, 1]) / 0.1)
        power = shown.power + (added * motion.dq).sum(axis=1)
        power += 2 * np.random.default_rng(seed).standard_normal(len(power))
        run = as_run(replace(shown, torque=shown.torque + added, power=power, current=None))
        made.append(replace(run, repeat_of=f"run_{seed - 1}" if (seed - first) % 2 else None))
    return data_set(ROBOT, made)


@pytest.fixture(scope="module")
def first():
    return diagnose(logged(0))


@pytest.fixture(scope="module")
def twin(first):
    return from_json(to_json(first.twin), Path("twin.json"))


@pytest.fixture(scope="module")
def bare():
    """A twin by the catalogue's expectations alone: nothing was fitted."""
    motion = measure(ROBOT, swing(ROBOT, 0, seconds=4.0), noise=0.3)
    return identify(ROBOT, [motion], [*BASELINE, "copper_loss"])


@pytest.mark.slow
def test_what_the_first_diagnosis_named_is_no_gap_for_its_twin(first, twin):
    assert {cause.effect for _, cause in first.causes} == {"stribeck_friction", "copper_loss"}
    again = diagnose(logged(20), twin=twin)
    assert again.verdict == "no_gap"
    assert {"stribeck_friction", "copper_loss"} <= set(again.twin.effect_ids)


@pytest.mark.slow
def test_friction_that_moved_is_no_gap_and_fitted_again(twin):
    again = diagnose(logged(30, grease=1.3), twin=twin)
    assert again.verdict == "no_gap"
    found = {one.joint: one.value for one in again.twin.parameters if one.name == "Fc"}
    assert list(found.values()) == pytest.approx(list(1.3 * truth(ROBOT)["Fc"]), rel=0.05)


@pytest.mark.nightly
@pytest.mark.slow
def test_only_what_is_new_is_named(twin):
    found = diagnose(logged(40, cable=15.0), twin=twin)
    (_, cause), *_ = found.causes
    assert (cause.effect, cause.joints) == ("cable_drag", ("joint_1",))
    assert all(one.get("folded_away") for one in found.to_json()["causes"][1:])
    assert {"stribeck_friction", "copper_loss", "cable_drag"} <= set(found.twin.effect_ids)


@pytest.mark.slow
def test_an_effect_withheld_from_a_twin_is_named_again(twin):
    found = diagnose(logged(20), twin=twin, withhold=["stribeck_friction"])
    (_, cause), *_ = found.causes
    assert "stribeck_friction" in (cause.effect, *cause.rivals)
    assert cause.joints == ("joint_2",)


@pytest.mark.parametrize("robot", OTHERS.values(), ids=OTHERS)
def test_a_twin_of_another_robot_is_refused(robot, bare):
    foreign = replace(bare, robot=robot)
    told = r"dataset\.toml: the twin is of another robot, arm_\d with the joints joint_1"
    with pytest.raises(InputError, match=told):
        baseline(logged(0), (), 0.2, foreign)


def test_withholding_what_a_given_twin_lacks(bare):
    with pytest.raises(InputError, match="--withhold payload: the twin does not have this effect; it has rigid_body"):
        baseline(logged(0), ["payload"], 0.2, bare)
    assert "copper_loss" not in [effect.id for effect in baseline(logged(0), ["copper_loss"], 0.2, bare).effects]


def test_a_given_twin_goes_before_what_the_data_set_says(bare):
    stated = replace(logged(0), effects=(*BASELINE, "cable_drag"))
    assert {effect.id for effect in baseline(stated, (), 0.2, bare).effects} == {*BASELINE, "copper_loss"}
    (first, *_) = said_of_twin(stated, bare)
    assert first.endswith("give way to the twin that is given: it has copper_loss; it lacks cable_drag")
    assert len(said_of_twin(replace(stated, effects=(*BASELINE, "copper_loss")), bare)) == 1


def test_effects_of_some_runs_stay_with_their_runs(bare):
    passing = replace(catalogue()["external_contact"], runs=("run_1",))
    held = replace(bare, effects=(*bare.effects, passing))
    assert passing not in baseline(logged(0), (), 0.2, held).effects
    assert any("external_contact" in line for line in said_of_twin(logged(0), held))


def test_shapes_and_joints_are_kept_and_sheets_completed(bare):
    sticks = StribeckFriction(vs=0.02, joints=("joint_2",))
    sheet = tuple(replace(joint, torque_constant=8.0) for joint in ROBOT.joints)
    given = replace(bare, effects=(*bare.effects, sticks), robot=replace(ROBOT, joints=sheet))
    begun = baseline(logged(0), (), 0.2, given)
    assert sticks in begun.effects
    assert [joint.torque_constant for joint in begun.robot.joints] == [8.0, 8.0]


def test_the_prior_decides_what_short_data_leave_open():
    long = [measure(ROBOT, swing(ROBOT, seed, seconds=20.0), noise=0.3, seed=seed) for seed in range(2)]
    short = measure(ROBOT, swing(ROBOT, 5, seconds=1.0), noise=3.0, seed=5)
    before = identify(ROBOT, long)
    alone, informed = identify(ROBOT, [short]), identify(ROBOT, [short], prior=before.prior)
    other = swing(ROBOT, 9, seconds=10.0)
    truth = measure(ROBOT, other).torque

    def error(twin):
        return np.sqrt(np.mean((twin.torque(other) - truth) ** 2))

    assert error(informed) < 0.3 * error(alone)
    assert error(informed) < 2 * error(before)


def test_each_number_may_have_moved(bare):
    exact, loose = bare.prior, baseline(logged(0), (), 0.2, bare).prior
    more = np.sqrt(np.diag(loose.covariance - exact.covariance))
    assert np.all(more >= 0.2 * np.abs(exact.values))
    assert np.all(more > 0)


def test_without_a_covariance_intervals_are_the_prior(bare):
    rough = replace(bare, covariance=None)
    one = next(parameter for parameter in bare.parameters if parameter.lower is not None)
    place = rough.prior.keys.index((one.effect, one.joint, one.link, one.name))
    assert rough.prior.covariance[place, place] == pytest.approx(bare.prior.covariance[place, place], rel=0.01)
    assert "intervals" in said_of_twin(logged(0), rough)[-1]
