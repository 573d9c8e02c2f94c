"""Data sets of small synthetic robots, identified in a second."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np

from irtwin.signals.log import Run
from tests import data_sets, synthetic

Change = Callable[[Run], Run]


def data_set(
    folder: Path, name: str, seed: int = 1, change: Change = lambda run: run, tail: str = "", joints: int = 2
) -> Path:
    """Write the data set of an arm with three runs of 8 s; `change` spoils each run."""
    robot = replace(synthetic.with_constants(synthetic.arm(joints)), name=name)
    motions = [synthetic.swing(robot, of, seconds=8.0) for of in range(seed, seed + 3)]
    runs = [synthetic.as_run(synthetic.measure(robot, motion, noise=0.01)) for motion in motions]
    return data_sets.write(folder, robot, [change(run) for run in runs], tail=tail)


def waiting_data_set(folder: Path, name: str) -> Path:
    """Write the simulated data set of an arm of two joints: three runs that move and one, `waiting`, that does not."""
    robot = replace(synthetic.with_constants(synthetic.arm(2)), name=name)
    motions = [synthetic.swing(robot, seed, seconds=8.0) for seed in range(1, 4)]
    still = np.zeros_like(motions[0].q)
    motions.append(replace(motions[0], q=still + 0.3, dq=still, ddq=still, run="waiting"))
    runs = [synthetic.as_run(synthetic.measure(robot, motion, noise=0.01)) for motion in motions]
    return data_sets.write(folder, robot, runs, head="simulated = true")


def with_signals(**scales: float) -> Change:
    """Multiply signals of each run by a number."""

    def change(run: Run) -> Run:
        scaled = {name: getattr(run.signals, name) * scale for name, scale in scales.items()}
        return replace(run, signals=replace(run.signals, **scaled))

    return change
