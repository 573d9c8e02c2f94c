"""What commands have to be so that a model can play them: there for each joint, in its unit and sense, and followed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.errors import InputError
from irtwin.robot.description import Joint
from irtwin.signals.log import DataSet, Run

_FOLLOWS = 0.8  # correlation of positions with commands, from which a joint goes where it is told
_DEGREES = (50.0, 65.0)  # commands over positions, as slope: 180/pi is between
_UNMOVED = 0.1  # rad or m: a joint that is told to go farther moves, whatever its friction and play


def commanded_runs(data_set: DataSet) -> list[Run]:
    """Return the observed runs, whose commands can be played.

    Raises InputError where there are none, or one has no commands, or those of a joint are in degrees, are its
    positions, go against these, or move nothing.
    """
    runs = [run for run in data_set.runs if run.role == "observed"]
    if not runs:
        raise InputError(f"{data_set.folder}: no run is observed; there is nothing to hold the model against")
    for run in runs:
        if run.signals.command is None:
            raise InputError(f"{run.file}: has no commands to play; log cmd_JOINT, or leave the run out")
    for k, joint in enumerate(data_set.robot.joints):
        each = [
            (run, run.signals.command[:, k], run.signals.q[:, k]) for run in runs if run.signals.command is not None
        ]
        for run, told, q in each:
            _check_run(run, joint, told, q)
        _check_sense(runs[0], joint, [(told, q) for _, told, q in each])
    return runs


def _check_run(run: Run, joint: Joint, told: np.ndarray, q: np.ndarray) -> None:
    if np.ptp(q) == 0 and np.ptp(told) > _UNMOVED:
        raise InputError(
            f"{run.file}: column q_{joint.name} does not change, though the joint is told to move by "
            f"{np.ptp(told):.2g} {joint.unit}: a dead channel, or a joint without power; leave the run out"
        )
    slope = np.polyfit(q - q.mean(), told - told.mean(), 1)[0] if np.ptp(q) > 0 else 1.0
    follows = slope * q.std() >= _FOLLOWS * told.std()  # a joint that is stuck may have any slope
    if joint.unit == "rad" and _DEGREES[0] < slope < _DEGREES[1] and follows:
        raise InputError(f"{run.file}: column cmd_{joint.name} is in degrees beside positions in rad; give it in rad")


def _check_sense(run: Run, joint: Joint, pairs: Sequence[tuple[np.ndarray, np.ndarray]]) -> None:
    """Raise where the commands of all runs go against the joint's positions, or are these; `run` is the first."""
    told, q = (np.concatenate([one - one.mean() for one in some]) for some in zip(*pairs, strict=True))
    if np.ptp(told) > _UNMOVED and np.array_equal(told, q):
        raise InputError(f"{run.file}: column cmd_{joint.name} is q_{joint.name}; log what the joint was told")
    if told @ q < -_FOLLOWS * np.linalg.norm(told) * np.linalg.norm(q):
        raise InputError(
            f"{run.file}: column cmd_{joint.name} goes against q_{joint.name}, as in all runs; reverse the sign of one"
        )
