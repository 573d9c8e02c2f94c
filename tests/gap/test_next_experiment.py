"""Experiments proposed for arms whose missing effect is known."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.document.form import to_json
from irtwin.effects.catalogue import BASELINE, catalogue
from irtwin.effects.effect import Predicted
from irtwin.effects.stack import Stack
from irtwin.gap import next_experiment as module
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.isolation.finding import finding_of
from irtwin.gap.isolation.steadied import Steadied
from irtwin.gap.isolation.structure_search import Attribution, judged
from irtwin.gap.next_experiment import next_experiment
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.evidence import evidence
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import MISSING, Hypothesis, hypotheses
from irtwin.gap.regression.projection import Projection
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification import progress
from irtwin.identification.programmes import programmes
from irtwin.report.gap.figures import experiment

pytestmark = pytest.mark.slow

ROBOT = arm(2)
NOISE = 0.2
RIVALS = "stribeck_friction", "nonlinear_viscous_friction"


def stribeck(motion):
    torque = np.zeros_like(motion.dq)
    torque[:, 1] = 3 * np.sign(motion.dq[:, 1]) * np.exp(-np.abs(motion.dq[:, 1]) / 0.05)
    return torque


def system_of(motions, effects):
    stack = Stack(ROBOT, BASELINE)
    values = np.array([term.expected for _, term in stack.torque_terms])
    alone = Grouping({m.run: m.run for m in motions}, frozenset(m.run for m in motions))
    return torque_system(stack, motions, alone, effects, lambda motion: Predicted(stack.real_torque(motion, values)))


def channel_of(motions, tried, cause=None, rivals=(), part=1.0):
    """The finding that an effect is missing on joint_2, beside rivals, which closes a part of the gap."""
    effects = [shape for effect in tried for shape in catalogue()[effect].candidates(ROBOT)]
    system = system_of(motions, effects)
    found = tuple(hypotheses(system.columns, system.base, MISSING))
    causes = ()
    if cause:
        (own,) = (one for one in found if (one.effect, one.joint) == (cause, "joint_2"))
        shown = evidence(Projection(system, np.full(2, NOISE), own.variants), (), own.variants).explained
        shape = own.variants[int(np.argmax(shown))]
        causes = (FoundCause(cause, MISSING, ("joint_2",), (shape,), 1.0, 9.0, 0.8, dict.fromkeys(rivals, 0.2)),)
    attribution = Attribution(causes, np.full(2, NOISE), found, np.zeros((len(found), 2)), np.zeros(0))
    none = np.full(2, np.inf)
    steadied = Steadied(system, {}, np.zeros(2), none, np.zeros((2, 2)))
    about = "torque", ROBOT.joint_names, frozenset(m.run for m in motions), system, steadied
    finding = finding_of(*about, attribution, None)
    vars(finding)["closed_squares"] = np.array([part * finding.counted.before for _ in causes])
    return finding, system_of


@pytest.fixture(scope="module")
def motions():
    """Fast motions of the arm, with torque that an effect adds to."""
    made = []
    for seed in range(3):
        motion = replace(swing(ROBOT, seed, 10.0), run=f"run_{seed}", cutoff=20.0)
        shown = measure(ROBOT, motion, noise=NOISE, seed=seed)
        made.append(replace(shown, torque=shown.torque + stribeck(motion)))
    return made


@pytest.fixture(scope="module")
def said():
    """What is told of how far the design has come."""
    return []


@pytest.fixture(scope="module")
def to_tell(motions, said):
    """What is proposed to tell two rivals apart."""
    with pytest.MonkeyPatch.context() as patch, progress.telling(said.append):
        patch.setattr(progress, "_EVERY", 0.0)
        return next_experiment(ROBOT, [channel_of(motions, RIVALS, RIVALS[0], RIVALS[1:])], [], motions, DEFAULT)


@pytest.fixture
def plain_programmes(monkeypatch):
    """Spare the search for an exciting motion."""

    def plain(*given):
        return (one for one, _ in zip(programmes(*given), range(2), strict=False))

    monkeypatch.setattr(module, "programmes", plain)


def test_what_a_programme_would_tell_is_told_once_it_is_measured(to_tell, motions):
    (question,) = to_tell.experiment.questions
    assert to_tell.experiment.separation_that_is_enough <= question.expected_separation
    assert question.expected_separation > question.separation_now
    planned = [replace(m, run=f"new_{k}") for k, m in enumerate(to_tell.programme.motions)]
    made = [measure(ROBOT, m, noise=NOISE, seed=50 + k) for k, m in enumerate(planned)]
    made = [replace(m, torque=m.torque + stribeck(m)) for m in made]
    again, _ = channel_of([*motions, *made], RIVALS, RIVALS[0])
    system = again.system.by_speed
    (cause,) = again.causes
    assert cause.variants[0].effect.id == RIVALS[0]
    own = Hypothesis(cause.effect, "joint_2", MISSING, cause.variants)
    noise = system.residual_rms(cause.columns, system.noise_before)
    others = [one for one in again.attribution.hypotheses if one.effect == RIVALS[1]]
    (found,) = judged(system, [own], [own, *others], DEFAULT.criterion, None, noise)
    assert module.separation(found, RIVALS[1]) == pytest.approx(question.expected_separation, rel=0.25)


def test_the_proposal_is_json_and_has_a_curve_to_draw(to_tell):
    said, curve = to_tell.experiment, to_tell.curve
    json.dumps(to_json(said), allow_nan=False)
    assert said.purpose == "tell stribeck_friction from nonlinear_viscous_friction"
    assert said.programme.joints == curve.joints
    assert len(curve.q) == len(curve.joints) and len(curve.q[0]) == len(curve.time) <= 450
    assert [line["name"] for line in experiment(curve)["data"]] == list(curve.joints)


@pytest.mark.parametrize("step", ["exciting motion, step", "weighing"])
def test_each_long_step_says_how_far_it_has_come(step, to_tell, said):
    assert any(step in line for line in said)


def test_the_shortest_programme_that_is_enough_is_chosen(to_tell):
    said = to_tell.experiment
    enough = [one for one in said.considered if one.expected_separation >= said.separation_that_is_enough]
    (chosen,) = (one for one in enough if one.kind == said.programme.kind)
    assert round(chosen.minutes) == min(round(one.minutes) for one in enough)


def test_a_page_draws_joints_that_turn_and_that_slide(motions):
    gantry = arm(2, slides=(1,))
    drawn = module.curve(gantry, next(iter(programmes(gantry, [], motions))))
    assert drawn.units == ("rad", "m")
    assert experiment(drawn)["layout"]["yaxis"]["title"]["text"] == "position, rad or m"


def test_what_no_motion_tells_apart_is_said(motions, plain_programmes):
    nothing = [replace(m, torque=m.torque - stribeck(m)) for m in motions]
    channel = channel_of(nothing, RIVALS, RIVALS[0], RIVALS[1:])
    said = next_experiment(ROBOT, [channel], [], nothing, DEFAULT).experiment
    assert said.programme is None and said.expected_separation is None
    assert said.note == f"{' and '.join(RIVALS)} cannot be told apart by any motion that was weighed"


def test_rivals_of_a_cause_that_closes_nothing_are_not_asked_for(motions):
    channel = channel_of(motions, RIVALS, RIVALS[0], RIVALS[1:], part=0.001)
    assert next_experiment(ROBOT, [channel], [], motions, DEFAULT) is None


def test_where_every_programme_would_last_too_long_it_is_said(motions, plain_programmes):
    slow = replace(ROBOT, joints=tuple(replace(joint, velocity=1e-5) for joint in ROBOT.joints))
    channel = channel_of(motions, RIVALS, RIVALS[0], RIVALS[1:])
    said = next_experiment(slow, [channel], [], motions, DEFAULT).experiment
    assert said.programme is None or said.programme.seconds <= 600


def test_what_no_motion_so_far_brings_about_is_shown_by_one_that_does(motions, plain_programmes):
    still = [replace(m, q=m.q * [0, 1], dq=m.dq * [0, 1], ddq=m.ddq * [0, 1]) for m in motions]
    still = [replace(measure(ROBOT, m, noise=NOISE, seed=k), run=m.run) for k, m in enumerate(still)]
    channel = channel_of(still, ["joint_coupling"])
    said = next_experiment(ROBOT, [channel], ["joint_coupling"], still, DEFAULT).experiment
    assert said.purpose == "show joint_coupling"
    (question,) = said.questions
    assert question.separation_now < said.separation_that_is_enough < question.expected_separation


def test_what_neither_a_motion_nor_a_hand_shows_is_not_asked_for(motions, plain_programmes):
    still = [replace(m, q=m.q * [0, 1], dq=m.dq * [0, 1], ddq=m.ddq * [0, 1]) for m in motions]
    still = [replace(measure(ROBOT, m, noise=1e3, seed=k), run=m.run) for k, m in enumerate(still)]
    assert next_experiment(ROBOT, [channel_of(still, ["joint_coupling"])], ["joint_coupling"], still, DEFAULT) is None


def test_what_the_data_would_show_is_not_asked_for(motions):
    channel = channel_of(motions, ["joint_coupling"])
    assert next_experiment(ROBOT, [channel], ["joint_coupling"], motions, DEFAULT) is None


def test_nothing_to_ask(motions):
    assert next_experiment(ROBOT, [channel_of(motions, ["payload"])], [], motions, DEFAULT) is None
