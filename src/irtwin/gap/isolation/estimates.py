"""Coefficients of the twin and of causes, fitted together: by one channel's equations, or by torque's and power's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import block_diag

from irtwin.gap.regression.joint_equations import JointEquations
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.estimators import Estimate, estimate


@dataclass(frozen=True)
class BesidePower:
    """Power beside torque: the `equations` of both, and what their search found of power.

    columns: those of the causes of power, of `equations.whole`; noise: (n + 1,) what all causes left of each equation.
    """

    equations: JointEquations
    columns: tuple[int, ...]
    noise: np.ndarray

    def estimate(self, chosen: Sequence[int]) -> Estimate:
        """Estimate the twin's terms of torque and `chosen` columns, as torque's equations count them, by both."""
        whole, torque = self.equations.whole, self.equations.torque
        fitted = estimate_of(whole, self._columns(chosen))
        used = [*range(torque.base), *range(whole.base, whole.base + len(chosen))]
        return fitted.of(used, fitted.noise[: len(torque.pattern)])

    def _columns(self, chosen: Sequence[int]) -> list[int]:
        return [*map(self.equations.in_whole, chosen), *self.columns]


def estimate_of(system: System, chosen: Sequence[int]) -> Estimate:
    """Estimate the twin's terms and the causes' together, with bounds and intervals."""
    used = [*range(system.base), *chosen]
    terms = [system.all_terms[k] for k in used]
    source = [k - len(system.columns) if k >= system.changed else k for k in used]
    pattern = system.pattern[:, source]
    blocks = []
    for block, observed in zip(system.blocks, system.observed, strict=True):
        factors = []
        for equation, factor in enumerate(block.factors):
            place = {int(k): p for p, k in enumerate(np.flatnonzero(system.pattern[equation]))}
            parts = [
                factor[:, place[s]] * (observed or k < system.changed)
                for k, s in zip(used, source, strict=True)
                if s in place
            ]
            factors.append(np.column_stack([*parts, factor[:, -1]]))
        blocks.append(replace(block, factors=tuple(factors)))
    rows = None if system.prior_rows is None else block_diag(system.prior_rows, np.eye(len(chosen)))
    signals = [*[0] * (len(pattern) - 1), 1] if system.beside_power else None
    return estimate(blocks, pattern, terms, rows, signals)
