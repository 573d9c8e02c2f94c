"""Commands that a model cannot play, or that say nothing of the robot, are refused; the others are played."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from tests.synthetic import arm, as_run, data_set, swing

from irtwin.errors import InputError
from irtwin.simulator.playing import commanded_runs

ROBOT = arm(2)


def logged(change=lambda told, q: (told, q), role="observed"):
    """Two runs whose positions are behind their commands, which `change` alters, both (N, 2)."""
    runs = []
    for seed in range(2):
        run = as_run(replace(swing(ROBOT, seed, seconds=5.0), run=f"run_{seed}"))
        q = run.signals.q
        told, q = change(np.roll(q, -5, axis=0), q)
        runs.append(replace(run, role=role, signals=replace(run.signals, command=told, q=q)))
    return data_set(ROBOT, runs)


def refused(change):
    with pytest.raises(InputError) as error:
        commanded_runs(logged(change))
    return str(error.value)


def test_commands_that_are_followed_are_played():
    assert len(commanded_runs(logged())) == 2


def test_a_joint_that_is_told_nothing_may_stand():
    stands = np.array([1.0, 0.0])
    assert len(commanded_runs(logged(lambda told, q: (told * stands, q * stands)))) == 2


def test_positions_that_stand_while_their_joint_is_told_to_move_are_refused():
    said = refused(lambda told, q: (told, q * [1.0, 0.0]))
    assert "column q_joint_2 does not change, though the joint is told to move by" in said
    assert "leave the run out" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda told, q: (told * [-1.0, 1.0], q), "column cmd_joint_1 goes against q_joint_1"),
        (lambda told, q: (q, q), "column cmd_joint_1 is q_joint_1; log what the joint was told"),
        (lambda told, q: (np.degrees(told), q), "column cmd_joint_1 is in degrees"),
        (lambda told, q: (None, q), "has no commands to play"),
    ],
    ids=["against the positions", "the positions", "in degrees", "none"],
)
def test_what_are_no_commands_is_refused(change, said):
    assert said in refused(change)


def test_observed_runs_are_needed():
    with pytest.raises(InputError, match="no run is observed"):
        commanded_runs(logged(role="reference"))
