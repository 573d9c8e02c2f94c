"""How far friction differs from run to run, as warmth and oil do: more than samples of one run tell."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import groupby

import numpy as np

from irtwin.effects.stack import Stack
from irtwin.identification.accumulate import Block
from irtwin.identification.estimators import Estimate, combine
from irtwin.identification.uncertainty import covariance

_FEWEST = 4  # runs: fewer tell no scatter


def with_run_scatter(stack: Stack, blocks: Sequence[Block], fit: Estimate) -> Estimate:
    """Return the estimate of coefficients of torque (K,), with friction as unsure as that of any one run.

    `blocks`: of torque. Scores that scatter more between runs than between stretches of time, in the mean over joints
    of what is of one name, show that coefficients of each run are their own. Fewer than four runs tell nothing of it.
    Bodies are the same in all runs, so they are held: what they could make up for does not differ from run to run.
    """
    names = [(effect.id, term.name) if effect.family == "friction" else None for effect, term in stack.torque_terms]
    where = np.array([name is not None for name in names])
    alone = [_alone(block, stack.pattern, fit.values, where) for block in blocks]
    by_run = [_joined(list(own)) for _, own in groupby(alone, key=lambda block: block.run)]
    if len(by_run) < _FEWEST or not where.any():
        return fit
    pattern, spread = stack.pattern[:, where], np.array([term.spread for _, term in stack.torque_terms])
    factors = [combine([block.factors[e] for block in alone], used) for e, used in enumerate(pattern)]
    prior = stack.prior_rows(stack.torque_terms)
    known = (np.eye(len(names)) if prior is None else prior)[:, where]

    def variances(parts: Sequence[Block]) -> np.ndarray:
        return np.diag(covariance(parts, pattern, factors, fit.values[where], fit.noise, spread[where], known)[0])

    between, within = variances(by_run), variances(alone)
    scatter, own_names = np.zeros(int(where.sum())), [name for name in names if name is not None]
    for name in set(own_names):
        own = [place for place, other in enumerate(own_names) if other == name]
        more = max(float(np.mean(between[own] / within[own])) - 1.0, 0.0)
        scatter[own] = len(by_run) * more * within[own]
    grown = fit.covariance.copy()
    grown[where, where] += scatter
    return replace(fit, covariance=grown)


def _alone(block: Block, pattern: np.ndarray, values: np.ndarray, where: np.ndarray) -> Block:
    """Return a block in those coefficients alone that `where` (K,) says; the others have their `values` (K,)."""
    factors = []
    for factor, used in zip(block.factors, pattern, strict=True):
        own, told = where[used], np.where(where[used], 0.0, values[used])
        factors.append(np.column_stack([factor[:, :-1][:, own], factor[:, -1] - factor[:, :-1] @ told]))
    return replace(block, factors=tuple(factors))


def _joined(blocks: Sequence[Block]) -> Block:
    """Return the blocks of a run as one."""
    factors = tuple(np.concatenate(own) for own in zip(*(block.factors for block in blocks), strict=True))
    return replace(
        blocks[0], stop=blocks[-1].stop, rows=np.sum([block.rows for block in blocks], axis=0), factors=factors
    )
