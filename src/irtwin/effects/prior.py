"""What is known of coefficients before any data: the numbers of an earlier twin, instead of the catalogue's."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from irtwin.effects.effect import Effect, Term

Key = tuple[str, str | None, str | None, str]
"""Of a coefficient: effect, joint, link, name."""

_SUREST = 1e-12  # of a squared spread: a combination that is known better is taken to be known so well


@dataclass(frozen=True)
class Prior:
    """p coefficients by key, with their `units`, `values` (p,) and `covariance` (p, p)."""

    keys: tuple[Key, ...]
    units: tuple[str, ...]
    values: np.ndarray
    covariance: np.ndarray

    def loosened(self, more: np.ndarray) -> Prior:
        """Return the prior with `more` standard deviation (p,) of each coefficient by itself."""
        return replace(self, covariance=self.covariance + np.diag(more**2))

    def informed(self, effect: Effect, term: Term) -> Term:
        """Return the term of an effect with what is known of it as its expectation."""
        place = self._place(effect, term)
        return term if place is None else replace(term, expected=float(self.values[place]))

    def rows(self, pairs: Sequence[tuple[Effect, Term]]) -> np.ndarray:
        """Return K equations (K, K) on the deviations of K terms from expectation, in units of their spread.

        Their noise is one. Terms of which nothing is known have a row each, as if there were no prior.
        """
        places = [self._place(effect, term) for effect, term in pairs]
        known = [k for k, place in enumerate(places) if place is not None]
        own = [place for place in places if place is not None]
        rows = np.eye(len(pairs))
        if known:
            spread = np.array([pairs[k][1].spread for k in known])
            scaled = self.covariance[np.ix_(own, own)] / np.outer(spread, spread)
            variances, axes = np.linalg.eigh(scaled)
            rows[np.ix_(known, known)] = (axes / np.sqrt(np.maximum(variances, _SUREST))).T
        return rows

    def _place(self, effect: Effect, term: Term) -> int | None:
        """Return where a term stands; None of an effect in some runs only, and of a term in another unit."""
        if effect.runs is not None or term.fixed:
            return None
        place = self._places.get((effect.id, term.joint, term.link, term.name))
        return place if place is not None and self.units[place] == term.unit else None

    @cached_property
    def _places(self) -> dict[Key, int]:
        return {key: place for place, key in enumerate(self.keys)}
