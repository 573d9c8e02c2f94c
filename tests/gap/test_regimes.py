"""Which regime a sample is in."""

from __future__ import annotations

import numpy as np

from irtwin.gap.localisation.excess_map import (
    JOINT_PARTS,
    JOINT_REGIMES,
    ROBOT_PARTS,
    ROBOT_REGIMES,
    joint_regimes,
    robot_regimes,
)
from irtwin.gap.thresholds import DEFAULT
from irtwin.signals.motion import Motion

RATE = 100.0


def trapezoid():
    """Rest 1 s, speed up 1 s, 1 rad/s for 1 s, slow down 1 s, rest 1 s, and the same back."""
    half = np.interp(np.arange(0, 5, 1 / RATE), [0, 1, 2, 3, 4, 5], [0, 0, 1, 1, 0, 0])
    speed = np.concatenate([half, -half])[:, None]
    time = np.arange(len(speed)) / RATE
    return Motion(
        time, np.cumsum(speed, axis=0) / RATE, speed, np.gradient(speed, 1 / RATE, axis=0), run="there_and_back"
    )


def of_joint(motion, torque=None):
    """The regimes of the only joint, sample by sample."""
    (found,) = joint_regimes([motion], [0 * motion.dq if torque is None else torque], 0, DEFAULT.data.little)
    return found


def at(found, names, second):
    row = found[round(second * RATE)]
    return {name for name, inside in zip(names, row, strict=True) if inside}


def test_a_joint_is_in_one_kinematic_regime_at_a_time():
    assert np.all(of_joint(trapezoid())[:, :JOINT_PARTS].sum(axis=1) == 1)


def test_a_joint_rests_speeds_up_keeps_its_speed_and_brakes():
    found = of_joint(trapezoid())
    seen = [at(found, JOINT_REGIMES, second) for second in (0.5, 1.5, 2.5, 3.5)]
    assert seen == [{"standstill"}, {"accelerating"}, {"steady_speed"}, {"braking"}]
    assert at(found, JOINT_REGIMES, 1.08) == {"low_speed"}


def test_a_reversal_is_a_change_of_direction_alone():
    time = np.arange(0, 4, 1 / RATE)
    speed = np.cos(np.pi * time / 2)[:, None]  # turns round at 1 s and 3 s
    motion = Motion(time, np.sin(np.pi * time / 2)[:, None], speed, np.gradient(speed, 1 / RATE, axis=0), run="swing")
    turning = of_joint(motion)[:, JOINT_REGIMES.index("reversal")]
    assert turning[97] and turning[303] and not turning[200]
    assert 20 <= turning.sum() <= 30


def test_a_loaded_joint_may_stand_still():
    motion = trapezoid()
    found = of_joint(motion, np.where(motion.time < 1, 10.0, 1.0)[:, None])
    assert at(found, JOINT_REGIMES, 0.5) == {"standstill", "loaded"}
    assert at(found, JOINT_REGIMES, 2.5) == {"steady_speed"}


def test_what_a_noisy_sensor_shows_at_rest_is_no_reversal():
    motion = trapezoid()
    shaken = motion.dq + np.where(motion.dq == 0, 5e-4 * np.sin(40 * motion.time)[:, None], 0.0)
    still = Motion(motion.time, motion.q, shaken, motion.ddq, run="noisy")
    assert at(of_joint(still), JOINT_REGIMES, 0.5) == {"standstill"}


def test_a_robot_gives_back_and_has_just_moved():
    motion = trapezoid()
    torque = 10.0 * motion.ddq
    (found,) = robot_regimes([motion], [torque], DEFAULT.data.little)
    assert np.all(found[:, :ROBOT_PARTS].sum(axis=1) == 1)
    assert at(found, ROBOT_REGIMES, 0.5) == {"standstill"}
    assert "regenerating" in at(found, ROBOT_REGIMES, 3.3)
    assert "regenerating" not in at(found, ROBOT_REGIMES, 1.7)
    assert at(found, ROBOT_REGIMES, 4.5) == {"standstill", "after_motion"}
