"""By how much the offset of a run may differ, where runs are few: as much as runs of one side show."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.data_sets import write
from tests.synthetic import arm, as_run, measure, swing

from irtwin.document.document import Document
from irtwin.effects.catalogue import EXCITED
from irtwin.effects.sensing import OffsetOfRun
from irtwin.effects.stack import Stack
from irtwin.gap.diagnosis import diagnose
from irtwin.gap.regression.channel_equations import torque_system
from irtwin.gap.regression.groups import Grouping
from irtwin.gap.regression.run_to_run import share_of_offsets
from irtwin.signals.log import read_data_set

DRY = 4.0  # N m
ROBOT = replace(arm(2), joints=tuple(replace(joint, dry_friction=DRY) for joint in arm(2).joints))


def share(offsets: list[list[float]], observed: int) -> float | None:
    """The share of runs with these offsets of each joint, N m, the last of which are `observed`."""
    motions = []
    for number, of_run in enumerate(offsets):
        motion = measure(ROBOT, swing(ROBOT, number, rate=100.0), noise=0.02, seed=number)
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


def diagnosed(folder: Path, changed: float) -> Document:
    """What is told where offsets differ by 0.1 N m a run, and that of joint 2 by `changed` in observed ones."""
    differs, runs = np.random.default_rng(5), []
    for number, role in enumerate(["reference"] * 3 + ["observed"] * 3):
        motion = measure(ROBOT, swing(ROBOT, number, rate=100.0), noise=0.05, seed=number)
        offset = 0.1 * differs.standard_normal(2) + [0.0, changed if role == "observed" else 0.0]
        logged = replace(motion, torque=motion.torque + offset, current=None, power=None)
        runs.append(replace(as_run(logged), name=f"run_{number}", role=role))
    return diagnose(read_data_set(write(folder / "set", arm(2), runs))).document


def test_an_offset_that_changed_by_more_than_runs_differ_is_told_and_closes_the_gap(tmp_path: Path) -> None:
    found = diagnosed(tmp_path, 1.0)
    assert [(cause.effect, cause.joints, cause.scope) for cause in found.causes] == [
        ("torque_offset", ("joint_2",), "changed")
    ]
    assert found.verdict == "attributed"
    assert found.shrink.closed_fraction.value > 0.8


@pytest.mark.slow
def test_offsets_that_differ_from_run_to_run_are_no_change(tmp_path: Path) -> None:
    assert diagnosed(tmp_path, 0.0).verdict == "no_gap"
