"""How dry friction turns at zero speed may differ from side to side: that is no change, and hides none."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.data_sets import write
from tests.synthetic import arm, as_run, measure, swing, truth

from irtwin.effects.friction import FrictionTurn, direction, turn
from irtwin.gap.diagnosis import diagnose
from irtwin.robot.description import Robot
from irtwin.signals.log import Run, read_data_set

ROBOT = arm(2)
WIDTH = 0.01  # rad/s


def run(seed: int, role: str, width: float, stronger: float) -> Run:
    """A run whose dry friction turns over some speed, `stronger` times the truth's at the first joint."""
    motion = measure(ROBOT, swing(ROBOT, seed), noise=0.05, seed=seed)
    assert motion.torque is not None
    dry = truth(ROBOT)["Fc"]
    now = dry * [stronger, 1.0]
    torque = motion.torque + now * np.tanh(motion.dq / width) - dry * np.sign(motion.dq)
    return replace(as_run(replace(motion, torque=torque, current=None, power=None)), name=f"{role}_{seed}", role=role)


def causes(folder: Path, width: float, stronger: float = 1.0) -> dict[str, tuple[str, ...]]:
    """What is told of observed runs whose friction turns over another speed: effects of 0.5 and more, their joints."""
    runs = [run(seed, "reference", WIDTH, 1.0) for seed in (1, 2, 3)]
    runs += [run(seed, "observed", width, stronger) for seed in (4, 5, 6)]
    found = diagnose(read_data_set(write(folder / "set", ROBOT, runs))).document
    return {cause.effect: tuple(cause.joints) for cause in found.causes if cause.confidence >= 0.5}


@pytest.mark.parametrize("width", [0.004, 0.025])
def test_a_turn_over_another_speed_is_no_change_of_friction(tmp_path: Path, width: float) -> None:
    assert causes(tmp_path, width) == {}


def test_a_change_of_dry_friction_is_told_beside_a_turn_over_another_speed(tmp_path: Path) -> None:
    assert causes(tmp_path, 0.025, stronger=1.3) == {"coulomb_friction": ("joint_1",)}


@pytest.mark.parametrize("width", [None, WIDTH])
def test_turns_over_half_to_four_times_the_speed_are_left_open(width: float | None) -> None:
    exponent = None if width is None else 2.0
    joints = tuple(replace(one, friction_width=width, friction_exponent=exponent) for one in ROBOT.joints)
    robot: Robot = replace(ROBOT, joints=joints)
    motion = swing(ROBOT, 1)
    columns = FrictionTurn().samples(robot, motion, None)
    for wider, column in zip((0.5, 2.0, 4.0), columns, strict=True):
        other = turn(motion.dq, wider * (width or 3e-3), 2.0)
        np.testing.assert_allclose(direction(robot, motion.dq) + column, other)
