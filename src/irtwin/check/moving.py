"""A data set's motion as the checks see it: few even samples of many runs, and what they were made of."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from irtwin.signals.channels import Signals
from irtwin.signals.conditioning import choose_cutoff, condition
from irtwin.signals.log import DataSet, Run, own_runs
from irtwin.signals.motion import Motion
from irtwin.signals.samples import FEWEST
from irtwin.signals.sampling import LEAST_RANGE

_MOST_RUNS = 8
_MOST_SAMPLES = 40_000  # of a run that are looked at


@dataclass(frozen=True)
class Moving:
    """Runs of a robot of n joints that move, as logged and conditioned, and which joints move in any of them, (n,)."""

    runs: tuple[Run, ...]
    motions: tuple[Motion, ...]
    joints: np.ndarray

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the runs."""
        return tuple(run.name for run in self.runs)


def moving(data_set: DataSet) -> Moving:
    """Return the runs in which something moves, conditioned with one cutoff; at most 8, the beginning of each."""
    long = [run for run in own_runs(data_set.runs)[:_MOST_RUNS] if len(run.signals.time) >= FEWEST]
    begun = [replace(run, signals=run.signals.rows(slice(_MOST_SAMPLES))) for run in long]
    runs = tuple(run for run in begun if _moves(run.signals).any())
    cutoff = choose_cutoff(runs) if runs else None
    motions = tuple(condition(run, data_set.robot, cutoff) for run in runs)
    joints = np.zeros(len(data_set.robot.joints), dtype=bool)
    for run in runs:
        joints |= _moves(run.signals)
    return Moving(runs, motions, joints)


def _moves(signals: Signals) -> np.ndarray:
    return np.asarray(np.ptp(signals.q, axis=0) > LEAST_RANGE)
