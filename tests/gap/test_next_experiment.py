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
from irtwin.gap.experiment.next_experiment import curve, next_experiment
from irtwin.gap.experiment.planned_equations import PlannedEquations, fitted, projected, unimitated
from irtwin.gap.experiment.programmes import programmes
from irtwin.gap.isolation.apart import Apart
from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.isolation.structure_search import Attribution
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.held_out import held_out
from irtwin.gap.regression.hypotheses import MISSING, hypotheses
from irtwin.gap.regression.moments import Summed
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.estimators import Estimate
from irtwin.identification.motion_limits import JointLimits
from irtwin.report.gap.figures import experiment

pytestmark = pytest.mark.slow

ROBOT = arm(2)
NOISE = 0.2


def seen(count=4, seconds=10.0, added=lambda motion: 0.0):
    """Fast motions of the arm, with torque that some effect adds to."""
    made = []
    for seed in range(count):
        motion = replace(swing(ROBOT, seed, seconds), run=f"run_{seed}", cutoff=20.0)
        shown = measure(ROBOT, motion, noise=NOISE, seed=seed)
        made.append(replace(shown, torque=shown.torque + added(motion)))
    return made


def stribeck(motion):
    torque = np.zeros_like(motion.dq)
    torque[:, 1] = 3 * np.sign(motion.dq[:, 1]) * np.exp(-np.abs(motion.dq[:, 1]) / 0.05)
    return torque


def alone(motions):
    return Grouping({m.run: m.run for m in motions}, frozenset(m.run for m in motions))


def ground_of(motions, tried, cause=None, rivals=(), part=1.0):
    """The finding that an effect is missing on joint_2, beside rivals, which closes a part of the gap."""
    stack = Stack(ROBOT, BASELINE)
    effects = [shape for effect in tried for shape in catalogue()[effect].candidates(ROBOT)]

    def predicted(motion):
        values = np.array([term.expected for _, term in stack.torque_terms])
        return stack.real_torque(motion, values)

    grouping = alone(motions)
    system = torque_system(stack, motions, grouping, effects, lambda motion: Predicted(predicted(motion)))
    found = tuple(hypotheses(system.columns, system.base, MISSING))
    noise = np.full(2, NOISE)
    causes = ()
    if cause:
        own = next(h for h in found if (h.effect, h.joint) == (cause, "joint_2"))
        causes = (Cause(cause, MISSING, ("joint_2",), own.variants[-1:], 1.0, 9.0, 0.8, dict.fromkeys(rivals, 0.2)),)
    attribution = Attribution(causes, noise, found, np.zeros((len(found), 2)), (), np.zeros(0))
    nothing = Estimate.__new__(Estimate)
    observed = frozenset(m.run for m in motions)
    judged = held_out(system, noise, noise, ())
    closed = np.array([part * judged.before for _ in causes])
    apart = Apart.of(system, system, [one.columns for one in causes])
    finding = Finding("torque", ROBOT.joint_names, observed, system, attribution, apart, judged, judged, None, nothing)
    vars(finding)["closed_squares"] = closed

    def planned(some, effects):
        return torque_system(stack, some, alone(some), effects, lambda motion: Predicted(predicted(motion)))

    return PlannedEquations(finding, ROBOT, planned, DEFAULT)


@pytest.fixture(scope="module")
def motions():
    return seen(added=stribeck)


def test_programmes_keep_the_limits_of_the_joints(motions):
    limits = JointLimits.of(ROBOT)
    made = list(programmes(ROBOT, ["joint_2"], motions, warm=True, take_off=[catalogue()["payload"]]))
    assert [one.kind for one in made][:2] == ["speed_ladder", "slow_sweep"]
    assert {"exciting_motion", "payload", "warm_up", "without_payload"} <= {one.kind for one in made}
    for one in made:
        json.dumps(to_json(one.said), allow_nan=False)
        for motion in one.motions:
            assert np.all((motion.q > limits.lower) & (motion.q < limits.upper))
            assert np.all(np.abs(motion.dq) <= limits.speed)
            assert np.all(np.abs(motion.ddq) <= limits.acceleration)
            assert motion.time[-1] <= 130


def test_speeds_and_accelerations_of_a_programme_belong_to_its_positions(motions):
    for one in programmes(ROBOT, ["joint_2"], motions):
        for motion in one.motions:
            step = 1 / motion.rate
            slope = np.diff(motion.q, axis=0) / step
            between = (motion.dq[1:] + motion.dq[:-1]) / 2
            largest = np.abs(motion.ddq).max()
            assert np.abs(slope - between).max() <= largest * step + 1e-9


def test_joints_that_are_not_asked_for_stand_still(motions):
    ladder = next(iter(programmes(ROBOT, ["joint_2"], motions)))
    assert np.ptp(ladder.motions[0].q[:, 0]) == 0
    assert set(ladder.settings.speeds) == {"joint_2"}


def test_a_page_draws_the_joints_that_move(motions):
    ladder = next(iter(programmes(ROBOT, ["joint_2"], motions)))
    drawn = curve(ROBOT, ladder)
    assert drawn.joints == ("joint_2",)
    assert len(drawn.q) == 1
    assert np.ptp(drawn.q[0]) > 0
    assert [line["name"] for line in experiment(drawn)["data"]] == ["joint_2"]


def test_positions_of_sliding_joints_are_in_metres(motions):
    gantry = arm(2, slides=(1,))
    both = next(iter(programmes(gantry, [], motions)))
    drawn = curve(gantry, both)
    assert drawn.units == ("rad", "m")
    assert experiment(drawn)["layout"]["yaxis"]["title"]["text"] == "position, rad or m"
    assert "m/s" in next(iter(programmes(gantry, ["joint_2"], motions))).text


@pytest.mark.parametrize(("speed", "rate"), [(1e-5, 100.0), (3.0, 50_000.0)])
def test_a_programme_lasts_minutes_and_has_no_million_samples(motions, speed, rate):
    robot = replace(ROBOT, joints=tuple(replace(joint, velocity=speed) for joint in ROBOT.joints))
    fast = [replace(motion, time=motion.time * motion.rate / rate, cutoff=rate / 5) for motion in motions]
    for one in programmes(robot, [], fast):
        for motion in one.motions:
            assert motion.time[-1] <= 600
            assert len(motion.time) <= 100_000


def test_where_every_programme_would_last_too_long_it_is_said(motions):
    robot = replace(ROBOT, joints=tuple(replace(joint, velocity=1e-5) for joint in ROBOT.joints))
    silent = catalogue()["stribeck_friction"]
    proposal = next_experiment(robot, [ground_of(motions, [silent.id])], [silent], motions, DEFAULT.matters.apart)
    assert proposal.programme is None or proposal.programme.seconds <= 600


def test_without_limits_those_that_were_seen_are_kept(motions):
    joints = tuple(replace(joint, lower=-np.inf, upper=np.inf) for joint in ROBOT.joints)
    free = replace(ROBOT, joints=joints)
    reached = np.concatenate([motion.q for motion in motions])
    for one in programmes(free, [], motions):
        for motion in one.motions:
            assert np.all(motion.q <= reached.max(axis=0)) and np.all(motion.q >= reached.min(axis=0))


def test_what_one_column_leaves_of_another_is_its_part_across():
    rows = 3000 * np.linalg.qr(np.random.default_rng(0).standard_normal((4000, 3)))[0]
    columns = np.column_stack([rows[:, 0], rows[:, 1], rows[:, 0] * 0.6 + rows[:, 1] * 0.8, 2 * rows[:, 1], rows[:, 2]])
    left = projected(columns.T @ columns, [])
    one = np.ones(1)
    assert unimitated(left, [2], one, [1]) / unimitated(left, [2], one, []) == pytest.approx(0.36, rel=0.05)
    assert unimitated(left, [3], one, [1]) == pytest.approx(4, rel=1e-2)  # what the prior of one unit costs
    assert fitted(left, [0])[0] == pytest.approx(0, abs=0.05)


def test_the_separation_expected_is_the_one_that_comes(motions):
    """Measure the programme, and compare the squares by which the rival fits worse."""
    channel = ground_of(
        motions,
        ["stribeck_friction", "nonlinear_viscous_friction"],
        "stribeck_friction",
        ["nonlinear_viscous_friction"],
    )
    proposal = next_experiment(ROBOT, [channel], [], motions, DEFAULT.matters.apart)
    (weight,) = proposal.weights
    assert proposal.programme is not None and weight.reached
    planned = [replace(m, run=f"new_{k}") for k, m in enumerate(proposal.programme.motions)]
    made = [measure(ROBOT, m, noise=NOISE, seed=50 + k) for k, m in enumerate(planned)]
    made = [replace(m, torque=m.torque + stribeck(m)) for m in made]
    again = ground_of([*motions, *made], ["stribeck_friction", "nonlinear_viscous_friction"]).finding.system
    total = projected(Summed(again.moments(np.full(2, NOISE))).whole, [*range(again.base)])
    shapes = {
        one.effect: [list(v.columns) for v in one.variants]
        for one in channel.finding.attribution.hypotheses
        if one.joint == "joint_2"
    }
    gains = {effect: max(total[own, -1] @ fitted(total, own) for own in each) for effect, each in shapes.items()}
    squares = gains["stribeck_friction"] - gains["nonlinear_viscous_friction"]
    tried = [k for each in shapes.values() for own in each for k in own]
    products = channel.products(proposal.programme, tried)
    now, then = products.left(())
    at = {effect: [[products.at[k] for k in own] for own in each] for effect, each in shapes.items()}
    true = max(at["stribeck_friction"], key=lambda own: now[own, -1] @ fitted(now, own))
    values = fitted(now, true)
    expected = min(unimitated(then, true, values, own) for own in at["nonlinear_viscous_friction"])
    assert np.sqrt(squares) == pytest.approx(np.sqrt(expected), rel=0.25)
    assert np.sqrt(squares / channel.dispersion) > 0.9 * weight.expected > weight.now


def test_of_two_names_for_one_thing_none_is_told(motions):
    channel = ground_of(motions, ["cable_drag", "payload"], "cable_drag", ["cable_drag"])
    proposal = next_experiment(ROBOT, [channel], [], motions, DEFAULT.matters.apart)
    assert proposal.programme is None
    assert "cannot be told apart" in proposal.experiment.note
    assert proposal.experiment.expected_separation is None


def test_rivals_of_a_cause_that_closes_nothing_are_not_asked_for(motions):
    channel = ground_of(motions, ["cable_drag", "payload"], "cable_drag", ["cable_drag"], part=0.001)
    assert next_experiment(ROBOT, [channel], [], motions, DEFAULT.matters.apart) is None


def test_a_payload_in_every_run_asks_for_runs_without(motions):
    channel = ground_of(motions, ["payload"])
    proposal = next_experiment(ROBOT, [channel], [catalogue()["payload"]], motions, DEFAULT.matters.apart)
    assert proposal.programme.kind == "without_payload"
    (weight,) = proposal.weights
    assert weight.now < 1 < DEFAULT.matters.apart < weight.expected


def test_temperature_that_nobody_logged_asks_for_a_warm_up(motions):
    channel = ground_of(motions, ["payload"])
    proposal = next_experiment(
        ROBOT, [channel], [catalogue()["temperature_dependent_friction"]], motions, DEFAULT.matters.apart
    )
    assert proposal.programme.kind == "warm_up"
    assert proposal.experiment.programme.temperatures == (25.0, 45.0)


def test_what_no_signal_shows_is_said_in_words(motions):
    channel = ground_of(motions, ["payload"])
    said = next_experiment(ROBOT, [channel], [catalogue()["copper_loss"]], motions, DEFAULT.matters.apart).experiment
    assert said.programme is None
    assert "log power" in said.motions[0]


def test_the_proposal_is_json_and_has_a_curve_to_draw(motions):
    channel = ground_of(
        motions,
        ["stribeck_friction", "nonlinear_viscous_friction"],
        "stribeck_friction",
        ["nonlinear_viscous_friction"],
    )
    proposal = next_experiment(ROBOT, [channel], [], motions, DEFAULT.matters.apart)
    said = proposal.experiment
    json.dumps(to_json(said), allow_nan=False)
    assert said.purpose == "tell stribeck_friction from nonlinear_viscous_friction"
    assert said.programme.joints == ("joint_2",) or said.programme.kind == "exciting_motion"
    assert said.expected_separation >= said.separation_now
    curve = proposal.curve
    assert len(curve.q) == len(curve.joints) and len(curve.q[0]) == len(curve.time) <= 450


def test_nothing_to_ask(motions):
    assert next_experiment(ROBOT, [ground_of(motions, ["payload"])], [], motions, DEFAULT.matters.apart) is None
