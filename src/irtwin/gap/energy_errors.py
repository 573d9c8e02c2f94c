"""How far the energy of runs is off that took no part in the fit."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.document.document import Change
from irtwin.gap.isolation.closing import half_width
from irtwin.gap.isolation.finding import ChannelFinding
from irtwin.gap.regression.moments import Summed
from irtwin.signals.motion import Motion


@dataclass(frozen=True)
class EnergyErrors:
    """Energy error of each observed group or run that was left out of the fit, %: (G,) before and after."""

    before: np.ndarray
    after: np.ndarray

    @property
    def mean(self) -> tuple[float, float]:
        """Over groups, before and after."""
        return float(self.before.mean()), float(self.after.mean())

    @property
    def change(self) -> Change:
        """The change, with its 95 % interval over groups, None of one."""
        before, after = self.mean
        ones = np.ones(len(self.after))
        half = half_width(after, self.after, ones, ones)
        ends = (max(after - half, 0.0), after + half) if len(ones) > 1 else None
        return Change(before=before, after=after, noise_floor=None, interval95_after=ends)


def energy_errors(
    finding: ChannelFinding, motions: Sequence[Motion], rest: Sequence[int] | None = None
) -> EnergyErrors:
    """Return the energy errors on groups left out: the sum of the residual is its product with a column of ones.

    `rest`: the columns that there are before; None: the twin as it is.
    """
    mean = {m.run: float(np.mean(m.power)) for m in motions if m.power is not None}
    errors = []
    after = finding.system, finding.chosen, finding.attribution.noise
    before = (finding.before, (), finding.rmse) if rest is None else (finding.system, rest, finding.attribution.noise)
    for system, columns, noise in (before, after):
        ones = next(k for k, column in enumerate(system.columns) if column.effect.drawn_at_rest) + system.base
        moments, level = system.moments(noise), float(max(noise[0], system.quietest[0]))
        total = Summed(moments)
        part = []
        for group in np.flatnonzero(system.group_observed):
            weights = np.append(-system.solution(columns, total, moments[group]), 1.0)
            residual = (moments[group].of(np.array([ones])) @ weights)[0] * level**2 / system.scale[ones]
            blocks = (system.blocks[block] for block in np.flatnonzero(system.group == group))
            energy = sum(mean[block.run] * float(block.rows[0]) for block in blocks)
            part.append(100 * abs(residual) / max(abs(energy), 1e-9))
        errors.append(np.array(part))
    return EnergyErrors(*errors)
