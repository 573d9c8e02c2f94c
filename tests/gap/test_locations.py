"""Where a gap of known place lies."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.synthetic import arm, rigid_torque, swing

from irtwin.effects.effect import Term
from irtwin.effects.friction import ViscousFriction
from irtwin.effects.transmission import JointCoupling
from irtwin.gap.isolation.cause import FoundCause
from irtwin.gap.localisation.channel_residuals import ChannelResidual, fitted_values
from irtwin.gap.localisation.excess_map import JOINT_REGIMES, heat_map, joint_maps, level_of, robot_maps
from irtwin.gap.localisation.locations import locate
from irtwin.gap.localisation.operating_variable import followed
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.hypotheses import MISSING, Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.residuals import Trace
from irtwin.gap.thresholds import DEFAULT
from irtwin.identification.accumulate import Block

pytestmark = pytest.mark.slow

ROBOT = arm(3)
JOINTS = ROBOT.joint_names
FLOOR = np.full(3, 0.5)


def traces(added=None, count=8, first=0, noise=0.5, role="run"):
    """Residuals of `count` runs: noise of the floor's size, and what is `added` (N, 3) N m for a motion."""
    found = []
    for seed in range(first, first + count):
        motion = replace(swing(ROBOT, seed, seconds=10.0), run=f"{role}_{seed}")
        residual = noise * np.random.default_rng(seed).standard_normal(motion.dq.shape)
        torque = rigid_torque(ROBOT, motion)
        if added is not None:
            residual = residual + added(motion, torque)
        found.append(Trace(motion, residual, torque))
    return found


def on(joint, function):
    """What a function of (motion, torque) adds at one joint."""

    def added(motion, torque):
        whole = np.zeros(motion.dq.shape)
        whole[:, joint] = function(motion, torque)
        return whole

    return added


def labels(*kinds):
    own = {trace.motion.run: trace.motion.run for kind in kinds for trace in kind}
    return Grouping(own, frozenset(own))


def located(observed, others=(), acting=None, leaving=None):
    seen, known = joint_maps((observed, others), labels(observed, others), DEFAULT.data.little)
    follows = [followed(observed, k, joint)[0] for k, joint in enumerate(JOINTS)]
    level = level_of(FLOOR, seen, known)
    return locate("torque", JOINTS, follows, seen, level, reference=known, acting=acting, leaving=leaving)


@pytest.mark.parametrize("moved, expected", [(1e-5, 2.0), (1.0, 3.0)], ids=["rests in other runs", "moves there"])
def test_other_runs_foretell_what_they_show(moved, expected):
    speed = np.linspace(-moved, moved, 400), np.linspace(-1, 1, 400)
    measured = [viscous * own + 0.1 * np.cos(9e3 * own) for viscous, own in zip((3.0, 2.0), speed, strict=True)]
    factors = [(np.column_stack(columns),) for columns in zip(speed, measured, strict=True)]
    blocks = (Block(f"run_{k}", 0.0, 1.0, np.array([400]), factor) for k, factor in enumerate(factors))
    terms = ((ViscousFriction(), Term("Fv", "N m s/rad", "joint_1", spread=30.0)),)
    system = System(terms, (), np.ones((1, 1), dtype=bool), tuple(blocks), np.arange(2), np.array([False, True]))
    values = fitted_values(SimpleNamespace(system=system, rmse=np.full(1, 0.1)), reference=True)
    assert values("run_1") == pytest.approx([expected], rel=0.05)


def test_noise_has_no_place():
    assert located(traces()) == []


def test_where_a_cause_acts_comes_before_what_stays_larger_elsewhere():
    def both(motion, torque):
        return np.column_stack([0.8 * motion.dq[:, 0], np.zeros(len(motion.dq)), 3 * motion.dq[:, 2]])

    assert located(traces(both))[0].joint == JOINTS[2]
    places = located(traces(both), acting=np.array([True, False, False]))
    assert [places[0].joint, places[-1].joint] == [JOINTS[0], JOINTS[2]]


def test_false_places_are_rare():
    found = sum(bool(located(traces(first=10 * trial))) for trial in range(20))
    assert found <= 3


@pytest.mark.parametrize(
    ("function", "regimes"),
    [
        (lambda m, t: 3 * np.sign(m.dq[:, 1]) * np.exp(-((m.dq[:, 1] / 0.05) ** 2)), {"low_speed", "reversal"}),
        (lambda m, t: 0.3 * m.ddq[:, 1], {"accelerating", "braking"}),
        (lambda m, t: 2.0 * (np.abs(t[:, 1]) > 0.5 * np.abs(t[:, 1]).max()), {"loaded"}),
    ],
)
def test_a_gap_has_its_joint_and_regime(function, regimes):
    first = located(traces(on(1, function)))[0]
    assert first.joint == "joint_2"
    assert first.regime in regimes
    assert first.concentration > 1
    assert first.false_discovery_rate < 0.05
    assert first.share_interval95[0] <= first.share <= first.share_interval95[1]
    assert 0 < first.excess_interval95[0] <= first.excess <= first.excess_interval95[1]


def test_a_gap_in_one_run_of_many_is_not_sure():
    mostly = traces(count=7)
    once = traces(on(0, lambda m, t: np.full(len(m.time), 2.0)), count=1, first=7)
    assert located([*mostly, *once]) == []


def test_a_cause_of_which_no_place_is_sure_has_those_to_which_it_adds():
    observed = traces(noise=0.3)
    inertia = on(1, lambda m, t: 0.1 * m.ddq[:, 1])
    added = [replace(trace, residual=inertia(trace.motion, trace.torque)) for trace in observed]
    seen, acts = joint_maps((observed, added), labels(observed, added), DEFAULT.data.little)
    acting = np.array([False, True, False])
    level = level_of(FLOOR, seen, None)
    places = locate("torque", JOINTS, [None] * 3, seen, level, acting=acting, acts=acts)
    assert {place.joint for place in places} == {"joint_2"}
    assert places[0].regime in {"accelerating", "braking", "reversal"}
    assert all(place.false_discovery_rate > 0.05 for place in places)


def test_the_joint_that_leaves_the_gap_open_is_named_though_no_place_of_it_is_sure():
    observed = [*traces(count=7), *traces(on(1, lambda motion, torque: 1.5 * np.sign(motion.dq[:, 1])), 1, first=7)]
    assert located(observed) == []
    assert {place.joint for place in located(observed, leaving=1)} == {JOINTS[1]}


def test_what_the_reference_runs_show_too_is_no_place():
    both = on(0, lambda m, t: 1.5 * np.sin(7 * m.q[:, 0]))
    assert located(traces(both), traces(both, first=20, role="reference")) == []
    places = located(traces(both), traces(first=20, role="reference"))
    assert {place.joint for place in places} == {"joint_1"}


def test_what_is_below_the_floor_is_no_place():
    assert located(traces(noise=0.3)) == []


def test_one_run_is_cut_in_time():
    (first, *_) = located(traces(on(2, lambda m, t: 0.2 * m.ddq[:, 2]), count=1))
    assert first.joint == "joint_3"


def test_places_without_a_known_floor_stand_out_of_their_joint():
    (seen,) = joint_maps([traces(on(1, lambda m, t: 2.0 * m.ddq[:, 1]))], labels(traces()), DEFAULT.data.little)
    places = locate("torque", JOINTS, ["acceleration"] * 3, seen, level_of(None, seen, None))
    assert places[0].joint == "joint_2"
    assert places[0].regime in ("accelerating", "braking", "loaded")


def test_a_map_has_every_joint_and_regime():
    (seen,) = joint_maps([traces()], labels(traces()), DEFAULT.data.little)
    drawn = heat_map(JOINTS, seen, level_of(FLOOR, seen, None))
    assert drawn.regimes == JOINT_REGIMES
    assert np.array(drawn.excess).shape == (3, len(JOINT_REGIMES))
    assert np.all(np.isfinite(drawn.excess))


def test_power_that_is_given_back_is_located():
    observed = []
    for trace in traces():
        given = np.minimum((trace.torque * trace.motion.dq).sum(axis=1), 0.0)
        observed.append(replace(trace, residual=(trace.residual[:, 0] - given)[:, None]))
    (seen,) = robot_maps([observed], labels(observed), DEFAULT.data.little)
    first = locate("power", (None,), ("mechanical_power",), seen, level_of(np.array([0.5]), seen, None))[0]
    assert (first.joint, first.regime) == (None, "regenerating")


@pytest.mark.parametrize(
    ("function", "variable"),
    [
        (lambda m, t: np.sin(4 * m.q[:, 1]), "angle"),
        (lambda m, t: np.sign(m.dq[:, 1]) * np.cos(3 * m.q[:, 1]), "angle"),
        (lambda m, t: m.dq[:, 1] ** 3, "speed"),
        (lambda m, t: 0.05 * np.abs(t[:, 1]) * np.sign(m.dq[:, 1]), "torque"),
        (lambda m, t: 0.5 * m.time, "time"),
    ],
)
def test_a_residual_follows_its_variable(function, variable):
    assert followed(traces(on(1, function)), 1, "joint_2")[0] == variable


def test_power_follows_the_torque_squared():
    observed = [
        replace(trace, residual=trace.residual[:, :1] + 0.01 * (trace.torque**2).sum(axis=1)[:, None])
        for trace in traces()
    ]
    assert followed(observed, 0, None)[0] == "torque_squared"


def test_a_coupling_acts_on_both_joints_of_its_pair():
    effect = JointCoupling()
    variant = Variant(effect, (0,), effect.terms(ROBOT)[:1])
    found = FoundCause("", MISSING, (JOINTS[2],), (variant,), gain=1.0, log_odds=9.0, probability=1.0)
    assert found.touched(ROBOT) == JOINTS[1:]
    empty = dict.fromkeys(("after", "seen", "acts", "reference", "level", "least"))
    finding = SimpleNamespace(places=JOINTS)
    left = ChannelResidual(finding, [], added=[], touched=[JOINTS[1:]], **empty)
    assert left.acting.tolist() == [False, True, True]
    assert replace(left, touched=[()]).acting.all() and not replace(left, touched=[]).acting.any()
