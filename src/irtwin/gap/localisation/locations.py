"""Where the gap lies: the joints and regimes whose residual is beyond the noise floor, and what is sure of it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy

from irtwin.document.document import FALSE_PLACES, LEAST_SHARE, GapLocation
from irtwin.gap.localisation.excess_map import FEWEST, LOADED, Map

_RESAMPLED = 1000
_LOADS = ("torque", "torque_squared")  # what the residual has to follow so that its place is the load


def locate(
    channel: str,
    joints: Sequence[str | None],
    follows: Sequence[str | None],
    seen: Map,
    level: np.ndarray,
    *,
    reference: Map | None = None,
    acting: np.ndarray | None = None,
    acts: Map | None = None,
    leaving: int | None = None,
    seed: int = 0,
) -> list[GapLocation]:
    """Return the places whose excess over the `level` (g, R) is beyond chance, the foremost first; `runs` are empty.

    joints, follows: of each of the g places its joint and the variable that its residual follows. The false discovery
    rate over places is held at 5 % (Benjamini and Hochberg); p-values are Student's over units, of the logarithm of
    the mean square over the level, against that of the `reference` where there is one. Joints on which causes are
    `acting` (g,) come before the others, all in the order of their excess; a joint's regimes in that of their share of
    it and its concentration there. A joint on which causes are acting, but none of whose places is sure, has those to
    which they add (`acts`) more than on average; the one whose excess leaves the gap open (`leaving`), those that show
    more than that. Places that overlap (`loaded` with all others) share the excess; the rate is that at which a place
    is found.
    """
    share, excess = (values[0] for values in _shares(seen, level, np.ones((1, len(seen.squares)))))
    units = len(seen.squares)
    weights = np.random.default_rng(seed).multinomial(units, np.full(units, 1 / units), _RESAMPLED)
    drawn = _shares(seen, level, weights.astype(float))
    share_ends, excess_ends = (np.quantile(values, [0.025, 0.975], axis=0) for values in drawn)
    concentration, q = _concentration(seen, share), _false_discovery(_p_values(seen, level, reference))
    acting = np.zeros(len(joints), dtype=bool) if acting is None else acting
    named = (share >= LEAST_SHARE) & (q <= FALSE_PLACES)
    rank = share * np.sqrt(concentration)
    if acts is not None:
        added = acts.squares.sum(axis=0)
        added = _over(added, added[:, : acts.parts].sum(axis=1, keepdims=True))
        more = _concentration(acts, added)
        unsure = acting & ~named.any(axis=1)
        named[unsure], rank[unsure] = more[unsure] > 1, (added * np.sqrt(more))[unsure]
    if leaving is not None and not named[leaving].any():
        named[leaving] = (concentration[leaving] > 1) & (share[leaving] >= LEAST_SHARE)
    places = [(place, r) for place, r in np.argwhere(named) if seen.regimes[r] != LOADED or follows[place] in _LOADS]
    whole = share[:, : seen.parts].sum(axis=1)
    places.sort(key=lambda at: (not acting[at[0]], -whole[at[0]], -rank[at]))
    return [
        GapLocation(
            channel=channel,
            joint=joints[place],
            regime=seen.regimes[r],
            follows=follows[place],
            runs=(),
            share=float(min(share[place, r], 1.0)),
            share_interval95=_ends(share_ends[:, place, r]),
            excess=float(excess[place, r]),
            excess_interval95=_ends(excess_ends[:, place, r]),
            concentration=float(concentration[place, r]),
            false_discovery_rate=float(q[place, r]),
        )
        for place, r in places
    ]


def _ends(both: np.ndarray) -> tuple[float, float]:
    return float(both[0]), float(both[1])


def _shares(seen: Map, level: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shares of the excess and the mean excess, (B, g, R) each, units weighted by (B, U)."""
    squares = np.einsum("bu,ugr->bgr", weights, seen.squares) / level
    counts = np.einsum("bu,ugr->bgr", weights, seen.counts)
    total = np.maximum(squares - counts, 0.0)
    whole = total[..., : seen.parts].sum(axis=(1, 2), keepdims=True)
    return _over(total, whole), np.where(counts > 0, _over(squares, counts) - 1, 0.0)


def _over(part: np.ndarray, whole: np.ndarray) -> np.ndarray:
    """Return the quotient, zero where there is no whole."""
    some = np.broadcast_to(whole > 0, part.shape)
    return np.asarray(np.divide(part, whole, out=np.zeros(part.shape), where=some))


def _concentration(seen: Map, share: np.ndarray) -> np.ndarray:
    """Return (g, R) the shares (g, R) within each place over those of its samples."""
    counts = seen.counts.sum(axis=0)
    samples, within = (_over(values, values[:, : seen.parts].sum(axis=1, keepdims=True)) for values in (counts, share))
    return _over(within, samples)


def _p_values(seen: Map, level: np.ndarray, reference: Map | None) -> np.ndarray:
    """Return one-sided p-values of the excess, (g, R); NaN where too few units tell (Welch, where it is compared)."""
    mean, variance, freedom = _moments(seen, level)
    if reference is not None:
        _, other, of_other = _moments(reference, level)
        parts = variance**2 / np.maximum(freedom, 1) + other**2 / np.maximum(of_other, 1)
        variance = variance + other
        freedom = np.where(freedom > 0, variance**2 / np.maximum(parts, np.finfo(float).tiny), 0)
    p = scipy.special.stdtr(np.maximum(freedom, 1), -mean / np.sqrt(np.maximum(variance, np.finfo(float).tiny)))
    return np.asarray(np.where(freedom > 0, p, np.nan))


def _moments(seen: Map, level: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mean over units of the logarithm of mean square over level, (g, R), its variance, and the freedom."""
    known = seen.counts >= FEWEST
    ratio = seen.squares / np.maximum(seen.counts, 1) / np.where(np.isfinite(level), level, 1.0)
    logs = np.where(known, np.log(np.maximum(ratio, np.finfo(float).tiny)), 0.0)
    number = np.maximum(known.sum(axis=0), 1)
    mean, freedom = logs.sum(axis=0) / number, np.maximum(known.sum(axis=0) - 1, 0)
    spread = np.where(known, (logs - mean) ** 2, 0.0).sum(axis=0)
    return mean, spread / np.maximum(freedom, 1) / number, freedom


def _false_discovery(p: np.ndarray) -> np.ndarray:
    """Return the rate of false discoveries at which each is one; 1 where p is not known."""
    known = np.isfinite(p)
    q = np.ones(p.shape)
    if known.any():
        q[known] = _adjusted(p[known])
    return q


def _adjusted(p: np.ndarray) -> np.ndarray:
    """Return p-values (M,) adjusted after Benjamini and Hochberg."""
    order = np.argsort(p)[::-1]
    q = np.empty(len(p))
    q[order] = np.minimum.accumulate(np.minimum(p[order] * len(p) / np.arange(len(p), 0, -1), 1.0))
    return q
