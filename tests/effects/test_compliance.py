"""Play and elasticity between motor and link: what passes, against what mechanics says must."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.synthetic import arm, swing

from irtwin.effects.compliance import Backlash, JointElasticity, load_inertia, load_torque, transmitted
from irtwin.effects.effect import Coefficients, Predicted, Quantity, Stated
from irtwin.robot.body_regressor import body_regressor
from irtwin.signals.motion import Motion

RATE = 250.0
TIME = np.arange(0, 6, 1 / RATE)
LOAD = (8 * np.sin(2 * np.pi * 0.4 * TIME) + 3 * np.sin(2 * np.pi * 0.9 * TIME + 1))[:, None]


def speed(hertz: float) -> np.ndarray:
    return np.full_like(LOAD, 2 * np.pi * hertz)


def test_a_stiff_gear_without_play_passes_the_load():
    (passed,) = transmitted(LOAD, np.ones_like(LOAD), RATE, speed(40), 0.5)
    np.testing.assert_allclose(passed, LOAD, atol=0.02 * np.abs(LOAD).max())


def test_a_link_that_grows_light_does_not_run_away():
    light = np.where(TIME[:, None] < 3, 5.0, 1e-4)
    (passed,) = transmitted(LOAD, light, RATE, 2 * np.pi * 40 * np.sqrt(5 / light), 0.1)
    assert np.abs(passed).max() < 2 * np.abs(LOAD).max()


def test_a_link_swings_at_its_own_frequency_after_a_jerk():
    jerk = np.where(TIME[:, None] < 2, 0.0, 5.0)
    passed = transmitted(jerk, np.ones_like(jerk), RATE, speed(6), 0.1)[0, TIME > 2, 0]
    crossings = np.flatnonzero(np.diff(np.sign(passed[: int(RATE)] - 5)) != 0)
    assert RATE / np.diff(crossings).mean() / 2 == pytest.approx(6, rel=0.05)
    assert passed[-1] == pytest.approx(5, rel=1e-3)


@settings(max_examples=20)
@given(st.floats(3e-4, 3e-3), st.floats(0.2, 5.0))
def test_play_delays_an_impulse_and_keeps_it(play, inertia):
    (passed,) = transmitted(LOAD, np.full_like(LOAD, inertia), RATE, speed(30), 0.5, (play,))
    lost = np.abs(passed - LOAD).sum() / RATE
    assert lost > 0.02
    assert abs((passed - LOAD).sum() / RATE) < 0.35 * lost


def test_more_play_loses_more():
    passed = transmitted(LOAD, np.ones_like(LOAD), RATE, speed(30), 0.5, (3e-4, 1e-3, 3e-3))
    assert (np.diff(np.abs(passed - LOAD).sum(axis=(1, 2))) > 0).all()


def loaded(joints):
    """An arm, a motion, and the load of each joint of an inertia of 2 kg m^2."""
    robot = arm(joints)
    motion = swing(robot, 5, seconds=4)
    load, inertia = 20 * np.sin(motion.q * 9), np.full_like(motion.dq, 2.0)
    return robot, motion, Predicted(np.zeros_like(motion.dq), load=load, inertia=inertia)


def test_what_the_rotor_has_of_the_inertia_does_not_pass_the_gap():
    robot, motion, said = loaded(2)
    link = Predicted(said.torque, load=said.load - 0.5 * motion.ddq, inertia=0.75 * said.inertia)
    (passed,) = Backlash(b=6e-4, rotor_share=0.25).samples(robot, motion, said)
    (expected,) = Backlash(b=6e-4).samples(robot, motion, link)
    np.testing.assert_allclose(passed, expected)


def test_by_way_all_of_the_load_is_lost_until_the_motor_has_crossed_the_gap():
    time = np.arange(0, 1, 1 / 1000)[:, None]
    motion = Motion(time[:, 0], 0.1 * time, np.full_like(time, 0.1), np.zeros_like(time), run="slow")
    load = 4 * (time - 0.3)
    (lost,) = Backlash(b=0.02, by_way=True).samples(arm(1), motion, Predicted(load, load=load))
    free, bound = (time > 0.302) & (time < 0.498), (time < 0.298) | (time > 0.502)  # 0.02 rad at 0.1 rad/s
    np.testing.assert_allclose(lost[free], -load[free])
    assert not lost[bound].any()


@pytest.mark.parametrize(
    "effect",
    [Backlash(), Backlash(b=0.01, by_way=True), JointElasticity(antiresonance=8.0)],
    ids=["backlash", "by_way", "elasticity"],
)
def test_a_part_with_its_reach_gives_what_the_whole_gives(effect):
    robot = arm(3)
    motion = swing(robot, 3, seconds=20, rate=200)
    load = load_torque(robot, motion, None)
    before = Predicted(load, load=load, inertia=load_inertia(robot, motion, None))
    whole = effect.columns(robot, motion, before)
    part = motion.part(1100, 2900)  # two seconds more on either side
    cut = effect.columns(robot, part, before.part(1100, 2900))
    np.testing.assert_allclose(cut[400:1400], whole[1500:2500], atol=1e-9)


@pytest.mark.parametrize("effect", [Backlash(), Backlash(by_way=True), JointElasticity(), JointElasticity(8.0)])
def test_one_joint_alone_is_as_among_others(effect):
    robot = arm(3)
    motion = swing(robot, 1, seconds=3.0)
    predicted = Predicted(30 * np.sin(motion.time[:, None] + np.arange(3)))
    (every,) = effect.samples(robot, motion, predicted)
    (one,) = effect.on(robot.joint_names[1]).samples(robot, motion, predicted)
    np.testing.assert_allclose(one[:, 1], every[:, 1], rtol=1e-12, atol=1e-12)
    assert every[:, 1].any() and not one[:, [0, 2]].any()


def test_bodies_that_no_motion_tells_apart_give_an_elastic_joint_the_same_columns():
    robot, motion = arm(3), swing(arm(3), 1, seconds=3)
    drawn = np.concatenate([body.toDynamicParameters() for body in list(robot.model.inertias)[1:]])
    regressor = body_regressor(robot.model, motion.q, motion.dq, motion.ddq).reshape(-1, len(drawn))
    unseen = np.linalg.svd(regressor)[2][np.linalg.matrix_rank(regressor) :]
    heavy = unseen.T @ unseen[:, 20]  # of what no motion shows, the most of the last body's mass
    bodies = drawn - 3 * heavy / heavy[20] * drawn[20]  # less than none
    elastic = JointElasticity(antiresonance=8.0)
    as_drawn, as_found = (
        elastic.columns(robot, motion, Predicted(np.zeros_like(motion.q), bodies=own)) for own in (drawn, bodies)
    )
    np.testing.assert_allclose(as_found, as_drawn, atol=1e-6 * np.abs(as_drawn).max())


def test_a_gap_that_is_known_about_passes_the_mean_of_it_and_of_those_about_it():
    robot, motion, said = loaded(1)
    (about,) = Backlash(b=1e-3, about=True).samples(robot, motion, said)
    each = [Backlash(b=1e-3 * 2 ** (2 * k / 3)).samples(robot, motion, said)[0] for k in (-1, 0, 1)]
    np.testing.assert_allclose(about, np.mean(each, axis=0), atol=1e-9)


def test_gaps_that_are_tried_together_are_as_each_alone():
    robot, motion, said = loaded(1)
    tried = Backlash().candidates(robot)[3:5]
    for one in tried:
        (alone,) = one.samples(robot, motion, Predicted(said.torque, load=said.load, inertia=said.inertia))
        np.testing.assert_allclose(one.samples(robot, motion, said)[0], alone, rtol=1e-12)
        assert alone.any()


def test_a_spring_behind_which_no_rotor_swings_is_as_soft_as_can_be():
    robot = arm(2)
    effect = JointElasticity(joints=("joint_1",))

    def stiffness(rotor: float) -> Quantity:
        given = Coefficients(np.array([1e-4]), np.array([[1e-12]]), {("rotor_inertia", "joint_1", "Ia"): rotor})
        return effect.parameters(robot, given)[0]

    least = effect.possible(robot, Stated())["K"].low
    assert stiffness(0.0).upper == 0.0
    assert stiffness(2e-4 * least).value == pytest.approx(2 * least)
    assert least == pytest.approx((2 * np.pi * 3) ** 2 * robot.mean_inertia[0])
