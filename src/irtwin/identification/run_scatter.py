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


def with_run_scatter(stack: Stack, blocks: Sequence[Block], found: Estimate) -> Estimate:
    """Return the estimate of coefficients of torque (K,), with friction as unsure as that of any one run.

    `blocks`: of torque. Scores that scatter more between runs than between stretches of time, in the mean over joints
    of what is of one name, show that coefficients of each run are their own. Fewer than four runs tell nothing of it.
    """
    by_run = [_joined(list(own)) for _, own in groupby(blocks, key=lambda block: block.run)]
    if len(by_run) < _FEWEST:
        return found
    pattern, terms = stack.pattern, [term for _, term in stack.torque_terms]
    factors = [combine([block.factors[e] for block in blocks], used) for e, used in enumerate(pattern)]
    spread, prior = np.array([term.spread for term in terms]), stack.prior_rows(stack.torque_terms)
    known = np.eye(len(terms)) if prior is None else prior

    def variances(parts: Sequence[Block]) -> np.ndarray:
        return np.diag(covariance(parts, pattern, factors, found.values, found.noise, spread, known)[0])

    between, within = variances(by_run), variances(blocks)
    scatter = np.zeros(len(terms))
    names = [(effect.id, term.name) if effect.family == "friction" else None for effect, term in stack.torque_terms]
    for name in set(names) - {None}:
        own = [place for place, other in enumerate(names) if other == name]
        more = max(float(np.mean(between[own] / within[own])) - 1.0, 0.0)
        scatter[own] = len(by_run) * more * np.diag(found.covariance)[own]
    return replace(found, covariance=found.covariance + np.diag(scatter))


def _joined(blocks: Sequence[Block]) -> Block:
    """Return the blocks of a run as one."""
    factors = tuple(np.concatenate(own) for own in zip(*(block.factors for block in blocks), strict=True))
    return replace(
        blocks[0], stop=blocks[-1].stop, rows=np.sum([block.rows for block in blocks], axis=0), factors=factors
    )
