"""What hypotheses explain beside a fit, and how far groups of runs agree on it.

A variant's columns, less what the fit imitates of them, have the information `A` and the score `b` in units of the
noise. Its coefficients `x` are those of least squares with the prior, within their bounds; they explain
`2 x.b - x.A.x` squares. In each group the score that is left over, `x.(b_g - A_g x)`, is what the group says
against them.
"""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np

from irtwin.gap.regression.hypotheses import Variant
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.projection import Projection

_SPEAKS = 1e-3  # of what a variant says in its strongest group: a group with less says nothing of it
_NOTHING = 1e-12  # squares, in units of the noise: what adds less acts nowhere
_FEW = 4.0  # groups' worth of weight that the spread of the other variants has beside a variant's own


class Coefficients(NamedTuple):
    """Those of n variants, at `places` (n,), that have k each: values (n, k), information (n, k, k).

    Values are beyond what is expected, in units of the prior.
    """

    places: np.ndarray
    values: np.ndarray
    information: np.ndarray


@dataclass(frozen=True)
class HypothesisEvidence:
    """V variants beside a fit, G halves of groups (`System.halves`); squares in units of the noise.

    explained (V,); said, missed (V, G): what each adds there, and the score that this leaves; `coefficients`, those of
    one number together; rows (G,); by_kind (V, `System.kinds`): of what is explained; of_power (V,): of it, what power
    shows beside torque; of_prior (V,): what is none of rows: with the variant those of the twin's numbers whose
    `prior_tells` are nearer to what is known of them; stand_for (V,): for how many shapes of a hypothesis each stands.
    """

    variants: tuple[Variant, ...]
    explained: np.ndarray
    said: np.ndarray
    missed: np.ndarray
    coefficients: tuple[Coefficients, ...]
    rows: np.ndarray
    by_kind: np.ndarray
    of_power: np.ndarray
    of_prior: np.ndarray
    stand_for: np.ndarray

    @cached_property
    def rows_that_speak(self) -> np.ndarray:
        """(V,) how many rows a variant acts in, effectively: an effect of one run has that run's."""
        total = self.said.sum(axis=1)
        squares = (self.said**2 / self.rows).sum(axis=1)
        shown = total > _NOTHING
        return np.asarray(np.where(shown, total**2 / np.where(shown, squares, 1.0), self.rows.sum()))

    @cached_property
    def unnamed(self) -> np.ndarray:
        """(V,) squares that a variant explains where it is as large as any healthy robot may have it."""
        squares = np.zeros(len(self.variants))
        for places, _, information in self.coefficients:
            shares = np.array([self.variants[place].unnamed for place in places])
            squares[places] = (np.diagonal(information, axis1=1, axis2=2) * shares**2).sum(axis=1)
        return squares

    @cached_property
    def disagreement(self) -> np.ndarray:
        """(V,) how much more groups disagree on a variant than noise makes them, 1 at least.

        A variant's own, moderated by that of the others, as groups are few (Smyth 2004).
        """
        speaks = self.said > _SPEAKS * np.maximum(self.said.max(axis=1, keepdims=True), 1e-300)
        more = np.maximum(speaks.sum(axis=1) - 1, 0)
        squares = np.where(speaks, self.missed**2 / np.maximum(self.said, 1e-300), 0.0).sum(axis=1)
        own = squares / np.maximum(more, 1)
        known = np.repeat(own, np.where(more >= 2, self.stand_for, 0))
        typical = max(float(np.median(known)), 1.0) if len(known) else 1.0
        return np.asarray(np.maximum((more * own + _FEW * typical) / (more + _FEW), 1.0))


def evidence(
    projection: Projection, chosen: Sequence[int], variants: Sequence[Variant], stand_for: np.ndarray | None = None
) -> HypothesisEvidence:
    """Return what variants explain beside the twin's terms and the `chosen` columns, everything refitted.

    stand_for: (V,) as `HypothesisEvidence` has it; None: each for itself.
    """
    system = projection.system
    (explained, nearer), (said, missed) = np.zeros((2, len(variants))), np.zeros((2, len(variants), len(system.parts)))
    coefficients = []
    known = {effect.id for effect, _ in system.terms} | {system.column(k).effect.id for k in chosen}
    beside = projection.beside(chosen)
    for places, columns, whole, parts in beside.batches(variants):
        own = [variants[place].columns for place in places]
        scale = system.scale[own]
        expected = np.array([[system.all_terms[k].expected for k in some] for some in own]) / scale
        lowest = np.array([_lowest(system, variants[place], known) for place in places]) / scale
        products, right = whole[..., :-1], whole[..., -1]
        fit = _bounded(products + np.eye(products.shape[1]), right + expected, lowest)
        explained[places] = 2 * (fit * right).sum(axis=1) - _squares(products, fit)
        nearer[places] = beside.nearer(columns, fit)
        squares, measured = beside.in_parts(columns, parts, fit)
        said[places], missed[places] = squares.T, (measured - squares).T
        coefficients.append(Coefficients(places, fit - expected, products))
    by_kind = (said + 2 * missed).reshape(len(variants), len(system.kinds), system.groups).sum(axis=2)
    said, missed = (_in_halves(system, squares) for squares in (np.maximum(said, 0.0), missed))
    halves = product(system.halves, range(system.groups))
    rows = np.array([max(float(system.rows[group, half].max()), 1.0) for half, group in halves])
    shown = np.maximum(explained, 0.0), said, missed
    of_power = by_kind[:, 1] if system.beside_power else np.zeros(len(variants))
    of_prior = np.clip(nearer, 0.0, shown[0])
    each = np.ones(len(variants), dtype=int) if stand_for is None else stand_for
    return HypothesisEvidence(tuple(variants), *shown, tuple(coefficients), rows, by_kind, of_power, of_prior, each)


def _in_halves(system: System, squares: np.ndarray) -> np.ndarray:
    """Return squares (V, P) of each part as those of each half and group (V, G): power's are with those of torque."""
    kinds = squares.reshape(len(squares), len(system.kinds), system.groups)
    starts = [kind for kind, own in enumerate(system.kinds) if own.start in {half.start for half in system.halves}]
    return np.add.reduceat(kinds, starts, axis=1).reshape(len(squares), len(starts) * system.groups)


def _lowest(system: System, variant: Variant, known: Set[str]) -> np.ndarray:
    """Return (k,) the lowest values: what is not `known` was nothing before, so that a change cannot take from it."""
    if system.both and variant.columns[0] >= system.changed and variant.effect.id in known:
        return np.full(len(variant.columns), -np.inf)
    return np.array([term.lowest for term in variant.terms])


def _squares(products: np.ndarray, values: np.ndarray) -> np.ndarray:
    return np.asarray(np.einsum("vi,vij,vj->v", values, products, values))


def _bounded(normal: np.ndarray, right: np.ndarray, lowest: np.ndarray) -> np.ndarray:
    """Solve V small systems (V, k, k); what falls below its bound is put there, the rest solved again."""
    solved = np.linalg.solve(normal, right[..., None])[..., 0]
    fixed = np.zeros(solved.shape, dtype=bool)
    for _ in range(normal.shape[1]):
        below = (solved < lowest) & ~fixed
        if not below.any():
            break
        fixed |= below
        held = np.where(fixed, lowest, 0.0)
        held[~np.isfinite(held)] = 0.0
        free = ~fixed
        system = normal * (free[:, :, None] & free[:, None, :])
        system[:, range(normal.shape[1]), range(normal.shape[1])] += fixed
        target = np.where(fixed, held, right - np.einsum("vij,vj->vi", normal, held))
        solved = np.linalg.solve(system, target[..., None])[..., 0]
    return solved
