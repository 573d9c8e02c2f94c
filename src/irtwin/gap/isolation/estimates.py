"""Coefficients of the twin and of causes, fitted together: by one channel's equations, or by torque's and power's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import groupby

import numpy as np
from scipy.linalg import block_diag

from irtwin.gap.regression.joint_equations import JointEquations
from irtwin.gap.regression.normal_equations import System
from irtwin.identification.accumulate import BLOCKS, Block
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
        covariance, noise = fitted.covariance[np.ix_(used, used)], fitted.noise[: len(torque.pattern)]
        return Estimate(fitted.values[used], covariance, noise, fitted.blocks)

    def keeping(self, chosen: Sequence[int]) -> BesidePower:
        """Return the same where `chosen` columns of torque alone are left."""
        return replace(self, noise=self.equations.whole.residual_rms(self._columns(chosen), self.noise))

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
    return estimate(_joined(blocks), pattern, terms, rows, signals)


def _joined(blocks: Sequence[Block]) -> list[Block]:
    """Return neighbours in a run joined, to as many as intervals need: short blocks depend on each other."""
    together = max(1, len(blocks) // BLOCKS)
    found = []
    for _, of_run in groupby(blocks, key=lambda block: block.run):
        own = list(of_run)
        found += [_whole(own[first : first + together]) for first in range(0, len(own), together)]
    return found


def _whole(blocks: Sequence[Block]) -> Block:
    factors = tuple(np.concatenate(own) for own in zip(*(block.factors for block in blocks), strict=True))
    rows = np.sum([block.rows for block in blocks], axis=0)
    return Block(blocks[0].run, blocks[0].start, blocks[-1].stop, rows, factors)
