"""Commands that are not what the joints were told are found, each fault by its kind; healthy ones are left alone."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, swing

from irtwin.check.check import check
from irtwin.errors import InputError
from irtwin.signals.log import read_data_set
from irtwin.simulator.playing import commanded_runs

ROBOT = arm(3)
SO101 = Path(__file__).parents[3] / "shared/data/so101"
BEHIND = 5  # samples of 10 ms


def logged(change=lambda told, q: (told, q), **signals):
    """Two runs whose positions are behind their commands, which `change` alters, both (N, 3)."""
    runs = []
    for seed in range(2):
        run = as_run(replace(swing(ROBOT, seed), run=f"run_{seed}"))
        told, q = change(np.roll(run.signals.q, -BEHIND, axis=0), run.signals.q)
        more = {name: values(q) for name, values in signals.items()}
        runs.append(replace(run, signals=replace(run.signals, command=told, q=q, **more)))
    return data_set(ROBOT, runs)


def said(change):
    return [(finding.fault, finding.stops, finding.say) for finding in check(logged(change)).findings]


def of_commands(found):
    return [finding for finding in check(found).findings if finding.channel.startswith("cmd")]


def frozen(told, q):
    told = told.copy()
    told[len(told) // 2 :, 1] = told[len(told) // 2, 1]
    return told, q


@pytest.mark.parametrize(
    "change",
    [
        lambda told, q: (told, q),
        lambda told, q: (told * [1.0, 0.0, 1.0], q * [1.0, 0.0, 1.0]),
        lambda told, q: (np.repeat(told[::20], 20, axis=0), q),
        lambda told, q: (told, 0.3 * np.roll(q, 30, axis=0)),
        lambda told, q: (np.column_stack([told[:, 0], np.roll(told[:, :1], 20), told[:, 2]]), q[:, [0, 0, 2]]),
    ],
    ids=["followed", "told nothing", "held for 0.2 s", "late and weak", "one motion"],
)
def test_healthy_commands_are_left_alone(change):
    assert said(change) == []
    assert len(commanded_runs(logged(change))) == 2


@pytest.mark.parametrize(
    ("change", "fault", "words"),
    [
        (lambda told, q: (told * [-1.0, 1.0, 1.0], q), "sign", "column cmd_joint_1 goes against q_joint_1"),
        (lambda told, q: (q, q), "copy", "column cmd_joint_1 is q_joint_1; log what the joint was told"),
        (lambda told, q: (np.degrees(told), q), "unit", "column cmd_joint_1 is in degrees"),
        (
            lambda told, q: (told[:, [1, 0, 2]], q), "swap",
            "cmd_joint_1, cmd_joint_2 stand in each other's columns, as in all runs: joint_1 follows cmd_joint_2, "
            "joint_2 follows cmd_joint_1; name them by their joints",
        ),
        (
            lambda told, q: ((told * [0.0, 1.0, 1.0])[:, [1, 0, 2]], q * [0.0, 1.0, 1.0]), "swap",
            "joint_2 follows cmd_joint_1; name them",
        ),
        (lambda told, q: (told[:, [1, 2, 0]], q), "order", "joint_3 follows cmd_joint_2; name them by their joints"),
        (lambda told, q: (np.roll(told, 50, axis=0), q), "delay", "column cmd_JOINT comes some 0.46 s after the pos"),
        (lambda told, q: (swing(ROBOT, 9).q, q), "foreign", "column cmd_JOINT is not followed by the joints that"),
        (frozen, "dead", "column cmd_joint_2 does not change from 10 s on, though the joint goes on moving"),
        (
            lambda told, q: (told, q * [1.0, 0.0, 1.0]), "dead",
            "column q_joint_2 does not change, though the joint is told to move by",
        ),
    ],
)  # fmt: skip
def test_faults_are_told_by_check_and_refused_by_a_diagnosis(change, fault, words):
    ((first, stops, say), *_) = said(change)
    assert (first, stops) == (fault, True)
    assert words in say
    with pytest.raises(InputError) as error:
        commanded_runs(logged(change))
    assert str(error.value) == say


@pytest.mark.parametrize(("change", "fault", "words"), [
    (lambda told: told[:, [1, 0, 2]], "swap", "stand in each other's columns: joint_1 follows cmd_joint_2"),
    (lambda told: np.roll(told, 50, axis=0), "delay", "column cmd_JOINT comes some 0.46 s after the positions"),
])  # fmt: skip
def test_a_fault_of_one_run_of_several_is_told_with_its_file(change, fault, words):
    found = logged()
    wrong = replace(
        found.runs[1], signals=replace(found.runs[1].signals, command=change(found.runs[1].signals.command))
    )
    many = [replace(found.runs[0], name=f"run_{name}") for name in "abc"]
    (finding,) = check(replace(found, runs=(*many, wrong))).findings
    assert (finding.fault, finding.runs, words in finding.say) == (fault, ("run_1",), True)
    assert finding.say.startswith("run_1.csv: ")


def test_beside_torque_nothing_has_to_be_cured():
    turned = logged(lambda told, q: (-told, q), torque=lambda q: 3.0 * q + 1.0)
    assert [finding.stops for finding in of_commands(turned)] == [False] * 3


@pytest.mark.slow
@pytest.mark.skipif(not SO101.exists(), reason="the measured logs are not here")
def test_measured_commands_are_left_alone_and_each_exchange_is_told():
    found = read_data_set(SO101, commanded=True)
    assert not of_commands(found)
    for a, b in ((0, 1), (1, 2), (3, 5)):
        order = np.arange(6)
        order[[a, b]] = b, a
        runs = tuple(
            replace(run, signals=replace(run.signals, command=run.signals.command[:, order])) for run in found.runs
        )
        (finding,) = of_commands(replace(found, runs=runs))
        names = [f"cmd_{found.robot.joint_names[joint]}" for joint in (a, b)]
        assert (finding.fault, finding.channel, finding.stops) == ("swap", " <-> ".join(names), True)
