"""Weighted least squares on accumulated factors, under a weak prior and physical bounds (Yan 2018, eqs. 5, 6)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy

from irtwin.effects.effect import Term
from irtwin.identification.accumulate import Block, Equations, accumulate, triangle
from irtwin.identification.progress import tell_step, track
from irtwin.identification.robust_weights import SETTLED, robust_weights
from irtwin.identification.uncertainty import covariance
from irtwin.signals.motion import Motion

_REWEIGHTINGS = 20  # at most
_LEAST_NOISE = 1e-6  # of the measurement's size: exact data still have finite weights,
_LEAST_SHOWN = 1e-10  # of a column as large as expected: dead data, too


@dataclass(frozen=True)
class Estimate:
    """Coefficients `values` (K,) with `covariance` (K, K), and the residual `noise` (g,) of each equation (RMS).

    `blocks` is the number of independent blocks behind the covariance. `equations` (K, K + 1): a triangle and a right
    side of noise one, what data and prior say of the values together, bounds apart. `weights` (B, g): by how much each
    block counted.
    """

    values: np.ndarray
    covariance: np.ndarray
    noise: np.ndarray
    blocks: int
    equations: np.ndarray
    weights: np.ndarray

    def of(self, places: Sequence[int], noise: np.ndarray | None = None) -> Estimate:
        """Return what is said of coefficients at some places, whatever the others are; `noise`: of equations left."""
        others = np.setdiff1d(np.arange(len(self.values)), places)
        turned = triangle(self.equations[:, [*others, *places, -1]])[len(others) :, len(others) :]
        own = np.ix_(places, places)
        left = self.noise if noise is None else noise
        return replace(
            self, values=self.values[list(places)], covariance=self.covariance[own], noise=left, equations=turned
        )


def estimate(
    blocks: Sequence[Block],
    pattern: np.ndarray,
    terms: Sequence[Term],
    prior_rows: np.ndarray | None = None,
    signals: Sequence[int] | None = None,
) -> Estimate:
    """Estimate the coefficients of `terms` (K) from g equations a sample.

    Each equation is weighted by its residual's inverse RMS, and each of its blocks by how little the fit leaves of it
    beside others (`robust_weights`), found by iteration. The prior of each term (mean `expected`, standard deviation
    `spread`) is one more row: against thousands of samples it decides nothing that they show, and what they do not show
    stays as expected (Tikhonov's ridge with physical units). Where more is known of the terms together, `prior_rows`
    (K, K) say it instead: rows on their deviations, in units of their spread, of noise one. As samples depend on each
    other, they count against it by their design effect only; where `signals` (g,) says which equations are of one, side
    by side, each signal by its own. Bounds hold. The covariance is explained in `uncertainty`.
    """
    given, weights = blocks, np.ones((len(blocks), len(pattern)))
    factors = _of_all(blocks, pattern)
    rows = np.array([block.rows for block in blocks])
    count = np.maximum(rows.sum(axis=0), 1)
    expected = np.array([term.expected for term in terms])
    spread = np.array([term.spread for term in terms])
    ends = np.array([(term.lowest, term.highest) for term in terms]).T
    prior = np.eye(len(terms)) if prior_rows is None else prior_rows
    size = np.array([np.linalg.norm(factor[:, -1]) for factor in factors]) / np.sqrt(count)
    shown = np.array([np.abs(factor[:, :-1] * spread).max(initial=0.0) for factor in factors])
    dead = np.maximum(_LEAST_SHOWN * shown, np.finfo(float).tiny)
    least = np.maximum(_LEAST_NOISE * size, dead)
    noise = np.maximum(size, dead)
    for _ in track(range(_REWEIGHTINGS), f"{len(terms)} coefficients, weighed anew"):
        values, _ = _solve(factors, noise, expected, spread, ends, prior)
        left, before = _left(given, pattern, values), (weights, noise)
        noise = np.maximum(np.sqrt((weights * left).sum(axis=0) / count), least)
        weights = robust_weights(left, rows, noise, size)
        blocks = [block.weighted(own) for block, own in zip(given, weights, strict=True)]
        factors = _of_all(blocks, pattern)
        if np.allclose(weights, before[0], atol=SETTLED) and np.allclose(noise, before[1], SETTLED, 0.0):
            break
    tell_step(f"  how sure {len(terms)} coefficients are")
    level = noise.copy()
    alike = np.zeros(len(pattern), dtype=int) if signals is None else np.array(signals)
    for signal in np.unique(alike):
        own = np.flatnonzero(alike == signal)
        mine = [block.of(slice(own[0], own[-1] + 1)) for block in blocks]
        _, effect = covariance(mine, pattern[own], [factors[e] for e in own], values, noise[own], spread, prior)
        level[own] *= np.sqrt(effect)
    values, equations = _solve(factors, level, expected, spread, ends, prior)
    tell_step(f"  how sure {len(terms)} coefficients are")
    sureness, _ = covariance(blocks, pattern, factors, values, level, spread, prior)
    return Estimate(values, sureness, noise, len(blocks), equations, weights)


def estimate_one(
    motions: Sequence[Motion],
    equations: Equations,
    terms: Sequence[Term],
    prior_rows: np.ndarray | None = None,
    every: int = 1,
) -> tuple[list[Block], Estimate]:
    """Estimate the coefficients of one equation a sample; return them with the equations, reduced by `accumulate`."""
    pattern = np.ones((1, len(terms)), dtype=bool)
    blocks = accumulate(motions, equations, pattern, every=every)
    return blocks, estimate(blocks, pattern, terms, prior_rows)


def _of_all(blocks: Sequence[Block], pattern: np.ndarray) -> list[np.ndarray]:
    """Return each equation's factor over all blocks."""
    return [combine([block.factors[e] for block in blocks], row) for e, row in enumerate(pattern)]


def _left(blocks: Sequence[Block], pattern: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Return the squares that values (K,) leave of each block and equation, (B, g)."""
    weights = [np.append(values[used], -1.0) for used in pattern]
    return np.array(
        [[np.sum((own @ by) ** 2) for own, by in zip(block.factors, weights, strict=True)] for block in blocks]
    )


def combine(factors: Sequence[np.ndarray], used: np.ndarray) -> np.ndarray:
    """Return one factor, of all K + 1 columns, of rows whose factors have only the `used` ones (K,)."""
    factor = triangle(np.concatenate(list(factors)))
    full = np.zeros((len(factor), len(used) + 1))
    full[:, np.append(used, True)] = factor
    return full


def _solve(
    factors: Sequence[np.ndarray],
    noise: np.ndarray,
    expected: np.ndarray,
    spread: np.ndarray,
    ends: np.ndarray,
    prior: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Return values between their ends (2, K), and their equations.

    They are solved for deviations from expectation in units of spread: well scaled.
    """
    rows = np.concatenate([factor / level for factor, level in zip(factors, noise, strict=True)])
    target = rows[:, -1] - rows[:, :-1] @ expected
    scaled = np.concatenate([rows[:, :-1] * spread, prior])
    target = np.concatenate([target, np.zeros(len(expected))])
    factor = triangle(np.column_stack([scaled, target]))
    left, right = factor[:-1, :-1], factor[:-1, -1]
    deviation = np.linalg.solve(left, right)
    bounds = (ends - expected) / spread
    if np.any((deviation < bounds[0]) | (deviation > bounds[1])):
        deviation = scipy.optimize.lsq_linear(left, right, bounds=tuple(bounds), method="bvls").x
    equations = np.column_stack([left / spread, right + left @ (expected / spread)])
    return np.clip(expected + deviation * spread, *ends), equations
