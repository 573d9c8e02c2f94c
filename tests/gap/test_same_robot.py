"""Reference runs of the robot are told from those of another, whatever either side shows of its bodies."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, heavier, measure, swing

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.effect import Term
from irtwin.effects.friction import CoulombFriction
from irtwin.errors import InputError
from irtwin.gap.data.case import case_of
from irtwin.gap.data.same_robot import _opposed
from irtwin.gap.search import Search
from irtwin.gap.thresholds import DEFAULT
from irtwin.robot.description import Robot
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion

DRAWN = arm(6)
BUILT = heavier(DRAWN, 1.5)


def run(role: str, motion: Motion, robot: Robot = BUILT) -> Run:
    seen = replace(measure(robot, motion, noise=0.3, seed=len(motion.run)), power=None, current=None)
    return replace(as_run(replace(seen, run=f"{role}_{motion.run}")), role=role)


def checked(references: list[Run]) -> None:
    observed = [run("observed", swing(DRAWN, seed)) for seed in (11, 12)]
    data = data_set(DRAWN, [*references, *observed], BASELINE, None)
    assert Search(case_of(replace(data, simulated=False), (), DEFAULT)).twin


def one_moving(seed: int, joint: int) -> Motion:
    motion = swing(DRAWN, seed)
    share = np.where(np.arange(6) == joint, 1.0, 0.01)
    return replace(motion, q=share * motion.q, dq=share * motion.dq, ddq=share * motion.ddq)


@pytest.mark.slow
@pytest.mark.parametrize("joint", range(0, 6, 2))
def test_references_that_move_one_joint_are_of_the_robot(joint: int) -> None:
    checked([run("reference", one_moving(seed, joint)) for seed in (1, 2)])


@pytest.mark.slow
def test_references_of_other_bodies_are_refused() -> None:
    with pytest.raises(InputError, match="is nothing like that of the observed runs"):
        checked([run("reference", swing(DRAWN, seed), heavier(DRAWN, 6.0)) for seed in (1, 2)])


@pytest.mark.parametrize(("drives", "opposed"), [(-1e-5, False), (-0.5, True)])
def test_a_simulator_without_friction_has_none_of_the_other_sign(drives: float, opposed: bool) -> None:
    terms = [(CoulombFriction(), Term("Fc", "N m", joint)) for joint in DRAWN.joint_names]
    system = SimpleNamespace(terms=terms, expected=np.zeros(6), scale=np.ones(6))
    found, _ = _opposed(DRAWN, system, np.ones(6), np.full(6, drives))
    assert found.tolist() == [opposed] * 6
