"""A joint's friction as one curve, held against a friction that is known."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, rigid_torque, swing, truth

from irtwin.document.curves import FrictionCurve
from irtwin.effects.catalogue import BASELINE
from irtwin.effects.friction import StribeckFriction, TemperatureDependentFriction
from irtwin.signals.conditioning import STANDSTILL
from irtwin.signals.motion import Motion
from irtwin.twin.friction_curve import friction_curves
from irtwin.twin.identify import identify

pytestmark = pytest.mark.slow

ROBOT = arm(2)
TRUE = truth(ROBOT)
FS, VS = 4.0, 0.1
STRIBECK = StribeckFriction(vs=VS)
Added = Callable[[Motion], np.ndarray]


def sliding(speed: np.ndarray, joint: int) -> np.ndarray:
    """What every joint of the tests has: Coulomb and viscous friction."""
    return np.asarray(TRUE["Fc"][joint] * np.sign(speed) + TRUE["Fv"][joint] * speed)


def stribeck(speed: np.ndarray) -> np.ndarray:
    return np.asarray(FS * np.sign(speed) * np.exp(-np.abs(speed) / VS))


def measured(added: Added, seed: int = 0) -> list[Motion]:
    """Runs in which the joints have some more torque, with noise."""
    found = []
    for of in (1, 2, 3):
        motion = measure(ROBOT, swing(ROBOT, of), 0.5, seed=10 * seed + of)
        found.append(replace(motion, torque=motion.torque + added(motion), power=None, current=None))
    return found


def curves_of(added: Added, *effects, seed: int = 0) -> tuple[FrictionCurve, ...]:
    """The curves of the twin that has these effects beside the usual ones."""
    motions = measured(added, seed)
    return friction_curves(identify(ROBOT, motions, [*BASELINE, *effects]), motions, "observed")


def nothing(motion: Motion) -> np.ndarray:
    return np.zeros_like(motion.dq)


def sticking(motion: Motion) -> np.ndarray:
    return stribeck(motion.dq)


def test_the_band_and_the_intervals_hold_the_truth():
    held, numbers = [], []
    for seed in range(10):
        for joint, curve in enumerate(curves_of(sticking, STRIBECK, seed=seed)):
            speed = np.array(curve.speed)
            true = sliding(speed, joint) + stribeck(speed)
            moving = np.abs(speed) > STANDSTILL
            held.append(((np.array(curve.low) <= true) & (true <= np.array(curve.high)))[moving].mean())
            known = {"Fc": TRUE["Fc"][joint], "Fv": TRUE["Fv"][joint], "Fs": FS}
            assert {one.name for one in curve.numbers} == known.keys()  # vs and d have no interval
            numbers += [one.lower <= known[one.name] <= one.upper for one in curve.numbers]
            assert np.abs(np.array(curve.torque) - true)[moving].max() < 0.3
    assert np.mean(held) > 0.85
    assert np.mean(numbers) > 0.85


def test_curves_and_numbers_have_units():
    robot = arm(2, slides=(1,))
    motion = measure(robot, swing(robot, 1), 0.1)
    curves = friction_curves(identify(robot, [motion], BASELINE), [motion], "reference")
    assert [(one.joint, one.role, one.unit, one.speed_unit) for one in curves] == [
        ("joint_1", "reference", "N m", "rad/s"),
        ("joint_2", "reference", "N", "m/s"),
    ]
    assert [one.unit for one in curves[1].numbers] == ["N", "N s/m"]


def test_speeds_are_those_that_the_motions_cover_both_ways():
    motions = measured(sticking)
    for joint, curve in enumerate(curves_of(sticking)):
        driven = np.concatenate([motion.dq[:, joint] for motion in motions])
        assert driven.min() <= curve.speed[0] < 0.9 * driven.min()
        assert 0.9 * driven.max() < curve.speed[-1] <= driven.max()
        assert np.all(np.diff(curve.speed) > 0)


def test_a_curve_is_odd_unless_friction_differs_by_direction():
    def asymmetric(motion: Motion) -> np.ndarray:
        return 2.0 * np.abs(motion.dq)

    def mean_of_directions(curve: FrictionCurve, speed: float) -> float:
        return float(np.interp((speed, -speed), curve.speed, curve.torque).mean())

    for plain, other in zip(curves_of(sticking), curves_of(asymmetric, "asymmetric_friction"), strict=True):
        assert np.abs([mean_of_directions(plain, speed) for speed in (0.1, 0.5, 1.0)]).max() < 0.02
        grown = mean_of_directions(other, 1.0) - mean_of_directions(other, 0.1)  # an offset looks like the rest
        assert grown == pytest.approx(2.0 * 0.9, rel=0.1)
        assert {one.name for one in other.numbers} == {"Fc", "Fv", "b"}  # a is that offset, so it has no interval


def test_measured_points_lie_on_the_true_curve_though_the_twin_lacks_an_effect():
    for joint, curve in enumerate(curves_of(sticking)):
        speed = np.array(curve.measured.speed)
        told = np.abs(speed) > 0.02  # in the bins next to standstill the truth bends
        left = np.array(curve.measured.torque) - sliding(speed, joint) - stribeck(speed)
        assert told.sum() > 10
        assert np.abs(left[told]).max() < 0.2
        assert np.all(np.array(curve.measured.low) < np.array(curve.measured.high))


def test_friction_that_depends_on_warmth_is_its_mean_over_the_runs():
    def at(motion: Motion, warmth: float) -> Motion:
        thinner = TRUE["Fv"] * [1, 0] * motion.dq * np.expm1(-0.02 * (warmth - 25))
        return replace(motion, torque=motion.torque + thinner, temperature=np.full(motion.q.shape, warmth))

    motions = [at(one, warmth) for one, warmth in zip(measured(nothing), (25.0, 35.0, 55.0), strict=True)]
    twin = identify(ROBOT, motions, [*BASELINE, TemperatureDependentFriction(k=0.02, joints=("joint_1",))])
    curve, _ = friction_curves(twin, motions[1:], "observed")
    slope = (curve.torque[-1] - curve.torque[-2]) / (curve.speed[-1] - curve.speed[-2])
    assert slope == pytest.approx(TRUE["Fv"][0] * np.exp([-0.2, -0.6]).mean(), rel=0.03)


def test_friction_that_depends_on_load_is_its_mean_over_the_runs():
    """The load holds friction that does not depend on it, in the direction of the curve."""

    def loads(motion: Motion) -> np.ndarray:
        return np.asarray(rigid_torque(ROBOT, motion) + TRUE["Ia"] * motion.ddq)

    def rubbing(motion: Motion) -> np.ndarray:
        other = np.stack([sliding(motion.dq[:, joint], joint) for joint in (0, 1)], axis=1)
        return np.asarray(0.2 * np.abs(loads(motion) + other) * np.sign(motion.dq))

    met = np.concatenate([loads(motion) for motion in measured(nothing)])
    for joint, curve in enumerate(curves_of(rubbing, "load_dependent_friction")):
        speed = np.array(curve.speed)
        speed = speed[np.abs(speed) > 0.1]
        found = np.interp(speed, curve.speed, curve.torque)
        plain = sliding(speed, joint)
        rubs = 0.2 * np.abs(met[:, joint, None] + plain).mean(axis=0) * np.sign(speed)
        assert found == pytest.approx(plain + rubs, rel=0.05)


def test_what_the_twin_does_not_know_has_no_curve():
    motions = measured(sticking)
    twin = identify(ROBOT, motions, BASELINE)
    still = [replace(one, dq=one.dq * [1, 0]) for one in motions]
    assert friction_curves(replace(twin, covariance=None), motions, "observed") == ()
    assert friction_curves(identify(ROBOT, motions, ["rigid_body"]), motions, "observed") == ()
    assert [one.joint for one in friction_curves(twin, still, "observed")] == ["joint_1"]
    bare = [replace(one, torque=None) for one in motions]
    assert [one.measured for one in friction_curves(twin, bare, "observed")] == [None, None]
