"""By how much the offset of a run may differ, where runs are few: as much as runs of one side show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, measure, swing

from irtwin.effects.catalogue import EXCITED
from irtwin.effects.sensing import OffsetOfRun
from irtwin.effects.stack import Stack
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.run_to_run import share_of_offsets

DRY = 4.0  # N m
ROBOT = replace(arm(2), joints=tuple(replace(joint, dry_friction=DRY) for joint in arm(2).joints))


def share(offsets: list[list[float]], observed: int) -> float | None:
    """The share of runs with these offsets of each joint, N m, the last of which are `observed`."""
    motions = []
    for number, of_run in enumerate(offsets):
        motion = measure(ROBOT, swing(ROBOT, number, rate=100.0), noise=0.02, seed=number)
        assert motion.torque is not None
        motions.append(replace(motion, run=f"run_{number}", torque=motion.torque + of_run))
    names = [motion.run for motion in motions]
    stack = Stack(ROBOT, [*EXCITED, *(OffsetOfRun(runs=(run,)) for run in names[1:])])
    grouping = Grouping({name: name for name in names}, frozenset(names[-observed:]))
    sides = [set(names[-observed:]), set(names[:-observed])]
    return share_of_offsets(torque_system(stack, motions, grouping, (), None), ROBOT, sides)


@pytest.mark.parametrize("changed", [0.0, 2.0], ids=["alike", "the observed run is another"])
def test_runs_of_one_side_tell_it_whatever_differs_between_the_sides(changed: float) -> None:
    found = share([[0.0, 0.0], [0.8, -0.8], [changed, 0.0]], observed=1)
    assert found == pytest.approx(2 * np.sqrt(2) * 0.4 / DRY, rel=0.1)


def test_runs_that_are_alike_may_differ_by_little_still() -> None:
    assert share([[0.0, 0.0]] * 3, observed=1) == 0.02


def test_one_run_a_side_tells_nothing() -> None:
    assert share([[0.0, 0.0], [1.0, 0.0]], observed=1) is None


def test_a_share_is_of_the_dry_friction_where_that_is_known() -> None:
    joint = ROBOT.joints[0]
    wide, narrow, unknown = (
        OffsetOfRun(share=share).joint_terms(replace(joint, dry_friction=dry))[0].spread
        for share, dry in ((None, DRY), (0.1, DRY), (0.1, None))
    )
    assert narrow == pytest.approx(0.1 * DRY)
    assert wide == unknown > 1.0
