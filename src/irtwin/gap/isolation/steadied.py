"""A channel's equations in which friction that differs from run to run is noise, and the floor without it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence, Set
from dataclasses import dataclass, replace

import numpy as np

from irtwin.gap.data.case import Case
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.run_to_run import RunToRun


@dataclass(frozen=True)
class Steadied:
    """The `system`; `shares`: by what each kind of coefficient of friction differs from run to run, of itself.

    made (g,): the mean square that this makes between repeats, or between all runs where none is repeated; sensors
    (g,): the RMS of their noise, infinite where it is unknown; positions (h, g): RMS that noise of positions makes of
    what the twin leaves, in rows apart.
    """

    system: System
    shares: Mapping[str, float]
    made: np.ndarray
    sensors: np.ndarray
    positions: np.ndarray

    @classmethod
    def of(cls, case: Case, system: System) -> Steadied:
        """Estimate it from the runs of a case; a simulator's friction does not differ."""
        runs = list(dict.fromkeys(block.run for block in system.blocks))
        sides = [own for side in case.sides if (own := side & set(runs))]
        differing = RunToRun.of(system, sides)
        rows = {run: np.sum([block.rows for block in system.blocks if block.run == run], axis=0) for run in runs}
        made = differing.mean_squares(_alike(case, runs, sides), rows)
        sensors = np.full(len(made), np.inf)  # not known: the floor stays as it is
        if case.sensor_noise is not None and len(made) >= len(case.sensor_noise):
            sensors[: len(case.sensor_noise)] = case.sensor_noise
        steadied = differing.steadied(system)
        positions = steadied.with_columns(())[0].by_speed.position_noise.reshape(-1, len(made))
        return cls(steadied, differing.shares, made, sensors, positions)

    def of_torque(self, torque: System) -> Steadied:
        """Return the same of the `torque` equations, the first of all that are here."""
        count = len(torque.pattern)
        blocks = tuple(block.of(slice(count)) for block in self.system.blocks if block.rows[:count].any())
        of_joints = self.made[:count], self.sensors[:count], self.positions[:, :count]
        return Steadied(replace(torque, blocks=blocks), self.shares, *of_joints)

    def floor(self, signal: np.ndarray | None) -> np.ndarray | None:
        """Return the noise floor, (g,) RMS, of that of the measured `signal`: with what noise of positions makes."""
        if signal is None:
            return None
        rows = self.system.by_speed.rows.sum(axis=0).reshape(self.positions.shape)
        positions = (self.positions**2 * rows).sum(axis=0) / np.maximum(rows.sum(axis=0), 1)
        return np.asarray(np.sqrt(signal**2 + positions))

    def within(self, signal: np.ndarray | None) -> np.ndarray | None:
        """Return the same within a run, where no dry friction turns; no less than the sensors' noise."""
        if signal is None:
            return None
        steady = np.maximum(signal**2 - self.made, np.minimum(self.sensors, signal) ** 2)
        return np.asarray(np.sqrt(steady + self.positions[0] ** 2))


def _alike(case: Case, runs: Sequence[str], sides: Sequence[Set[str]]) -> list[list[str]]:
    """Return the runs that differ by noise and friction alone: repeats of a motion, or all where there are none."""
    label = case.grouping.label
    repeats = [[run for run in runs if label[run] == first] for first in dict.fromkeys(label[run] for run in runs)]
    several = [some for some in repeats if len(some) > 1]
    return several or [sorted(side) for side in sides]
