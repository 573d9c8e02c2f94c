"""How dry friction turns at zero speed is found in each joint, whatever the law, and a sharp one stays sharp."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.synthetic import arm, measure, swing, truth

from irtwin.effects.friction import StribeckFriction, direction, turn
from irtwin.effects.stack import Stack
from irtwin.identification.fits import fit_torque
from irtwin.identification.friction_near_zero import with_friction_near_zero
from irtwin.robot.description import Robot
from irtwin.signals.motion import Motion
from irtwin.twin.files import from_json, to_json
from irtwin.twin.identify import identify

ROBOT = arm(2)
EFFECTS = ("rigid_body", "rotor_inertia", "coulomb_friction", "viscous_friction", "torque_offset")
Law = Callable[[np.ndarray], np.ndarray]
LAWS: dict[str, Law] = {
    "tanh": lambda u: np.tanh(u),
    "atan": lambda u: np.arctan(u) * 2 / np.pi,
    "root": lambda u: u / np.sqrt(1 + u**2),
    "ramp": lambda u: np.clip(u, -1, 1),
}


def measured(law: Law | None, width: float, seed: int) -> Motion:
    """Return a motion with the truth's torque, dry friction by a law of speed over `width` rad/s; None: sharp."""
    slow = swing(ROBOT, seed)
    motion = measure(ROBOT, slow, noise=0.05, seed=seed)
    if law is None:
        return motion
    dry = truth(ROBOT)["Fc"]
    return replace(motion, torque=motion.torque + dry * (law(motion.dq / width) - np.sign(motion.dq)))


def left(robot: Robot, motions: list[Motion]) -> np.ndarray:
    return fit_torque(Stack(robot, EFFECTS), motions)[1].noise


@pytest.mark.slow
@pytest.mark.parametrize("width", [0.006, 0.02])
@pytest.mark.parametrize("law", LAWS)
def test_a_soft_law_is_followed_and_its_friction_found(law: str, width: float) -> None:
    motions = [measured(LAWS[law], width, seed) for seed in (1, 2)]
    robot, _ = with_friction_near_zero(ROBOT, motions, EFFECTS)
    assert np.all(left(robot, motions) < 0.07)  # of noise of 0.05 N m
    assert np.all(left(ROBOT, motions) > 0.07)
    speeds = np.repeat(np.linspace(-4 * width, 4 * width, 81)[:, None], 2, axis=1)
    np.testing.assert_allclose(direction(robot, speeds), LAWS[law](speeds / width), atol=0.12)
    np.testing.assert_allclose([joint.dry_friction for joint in robot.joints], truth(ROBOT)["Fc"], rtol=0.05)


def test_sharp_friction_stays_sharp() -> None:
    robot, _ = with_friction_near_zero(ROBOT, [measured(None, 1.0, seed) for seed in (1, 2)], EFFECTS)
    np.testing.assert_allclose(direction(robot, np.array([[0.006, -0.006]])), [[1, -1]], atol=0.02)
    np.testing.assert_allclose([joint.dry_friction for joint in robot.joints], truth(ROBOT)["Fc"], rtol=0.05)


@pytest.mark.parametrize(
    "law", [lambda dq: np.sign(dq) * np.abs(dq) ** 0.6, lambda dq: np.sign(dq) * np.exp(-((dq / 0.1) ** 2))]
)
def test_sharp_friction_that_bends_as_the_joint_speeds_up_stays_sharp(law: Law) -> None:
    motions = [measured(None, 1.0, seed) for seed in (1, 2)]
    bent = [replace(motion, torque=motion.torque + 4.0 * law(motion.dq)) for motion in motions]
    robot, _ = with_friction_near_zero(ROBOT, bent, EFFECTS)
    assert all((joint.friction_width or 0.0) < 0.002 for joint in robot.joints)


def test_joints_have_laws_of_their_own() -> None:
    sharp, soft = measured(None, 1.0, 3), measured(LAWS["root"], 0.01, 3)
    mixed = replace(sharp, torque=np.column_stack([sharp.torque[:, 0], soft.torque[:, 1]]))
    first, second = with_friction_near_zero(ROBOT, [mixed], EFFECTS)[0].joints
    assert (first.friction_width or 0.0) < 0.003
    assert second.friction_width == pytest.approx(0.01, rel=0.3)
    assert second.friction_exponent == pytest.approx(2.0, rel=0.3)


def test_a_turn_is_over_where_friction_that_is_known_fades() -> None:
    motions, fading = [measured(LAWS["tanh"], 0.03, seed) for seed in (1, 2)], StribeckFriction(vs=0.05)
    robot, _ = with_friction_near_zero(ROBOT, motions, (*EFFECTS, fading), set(ROBOT.joint_names))
    assert fading.on(*ROBOT.joint_names) in fading.candidates(robot)  # else it could not be found again


def test_without_torque_friction_turns_at_once() -> None:
    known = replace(
        ROBOT, joints=tuple(replace(one, friction_width=0.01, friction_exponent=2.0) for one in ROBOT.joints)
    )
    robot, _ = with_friction_near_zero(known, [replace(measured(None, 1.0, 1), torque=None)], EFFECTS)
    assert [(joint.friction_width, joint.dry_friction) for joint in robot.joints] == [(None, None)] * 2


def test_a_twin_keeps_it_in_its_file(tmp_path) -> None:
    twin = identify(ROBOT, [measured(LAWS["root"], 0.01, seed) for seed in (1, 2)])
    assert from_json(to_json(twin), tmp_path / "twin.json").robot.joints == twin.robot.joints
    assert twin.robot.joints[0].friction_width == pytest.approx(0.01, rel=0.3)
    friction = next(one for one in twin.parameters if one.effect == "coulomb_friction")
    assert friction.value == pytest.approx(truth(ROBOT)["Fc"][0], rel=0.02)


@settings(max_examples=50)
@given(width=st.floats(1e-3, 0.03), exponent=st.floats(1.0, 8.0), speed=st.floats(1e-9, 5.0))
def test_a_turn_is_odd_rises_and_stays_within_one(width: float, exponent: float, speed: float) -> None:
    here, faster = turn(np.array([speed, 1.01 * speed]), width, exponent)
    assert 0 < here <= faster + 1e-15 <= 1 + 1e-12
    assert turn(np.array([-speed]), width, exponent)[0] == -here
    assert here <= speed / width * (1 + 1e-12)
