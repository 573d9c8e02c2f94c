"""Where the gap lies: the joints and regimes whose residual is beyond the noise floor, and what is sure of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import false_discovery_control, t

from irtwin.document.document import FALSE_PLACES, LEAST_SHARE
from irtwin.gap.localisation.excess_map import Map
from irtwin.gap.localisation.regimes import (
    ACCELERATING,
    BRAKING,
    LOADED,
    LOW_SPEED,
    REGENERATING,
    REVERSAL,
    STANDSTILL,
    STEADY_SPEED,
)
from irtwin.gap.regression.residuals import Trace
from irtwin.gap.thresholds import Places

_RESAMPLED = 1000
_LOADS = ("torque", "torque_squared")  # what the residual has to follow so that its place is the load
_SUITS = {
    "speed": (LOW_SPEED, REVERSAL, STEADY_SPEED, STANDSTILL),
    "acceleration": (ACCELERATING, BRAKING),
    "torque": (LOADED, ACCELERATING, BRAKING, STANDSTILL),
    "torque_squared": (LOADED, ACCELERATING, BRAKING, STANDSTILL),
    "mechanical_power": (REGENERATING, ACCELERATING, BRAKING),
}


@dataclass(frozen=True)
class Location:
    """A place of the gap: the excess of its mean square over the floor's, with 95 % intervals over runs.

    `share` of the channel's whole excess; places that overlap (`loaded` with all others) share it. `q`: the rate of
    false discoveries at which the place is found. `concentration`: the place's share of its joint's excess over its
    share of the samples. `rank` orders those of one joint.
    """

    channel: str
    joint: str | None
    regime: str | None
    follows: str | None
    runs: tuple[str, ...]
    share: float
    share_interval: tuple[float, float]
    excess: float
    excess_interval: tuple[float, float]
    concentration: float
    q: float
    rank: float


def locate(
    channel: str,
    joints: Sequence[str | None],
    follows: Sequence[str | None],
    seen: Map,
    level: np.ndarray,
    *,
    limits: Places,
    reference: Map | None = None,
    explained: Map | None = None,
    acting: np.ndarray | None = None,
    acts: Map | None = None,
    leaving: int | None = None,
    seed: int = 0,
) -> list[Location]:
    """Return the places whose excess over the `level` (g, R) is beyond chance, the foremost first; `runs` are empty.

    joints, follows: of each of the g places its joint and the variable that its residual follows. The false discovery
    rate over places is held at 5 % (Benjamini and Hochberg); p-values are Student's over units, of the logarithm of
    the mean square over the level, against that of the `reference` where there is one; where causes are `acting` (g,),
    also of that over what they leave, `explained`. Joints on which causes are acting come before the others, all in
    the order of their excess; a joint's regimes in that of their share of it, its concentration there, and whether they
    suit the variable. A joint on which causes are acting, but none of whose places is sure, has those to which they add
    (`acts`) more than on average; the one whose excess leaves the gap open (`leaving`), those that show more than that.
    """
    share, excess = _shares(seen, level, np.ones((1, len(seen.squares))))
    rng = np.random.default_rng(seed)
    weights = rng.multinomial(len(seen.squares), np.full(len(seen.squares), 1 / len(seen.squares)), _RESAMPLED)
    drawn_share, drawn_excess = _shares(seen, level, weights.astype(float))
    of_joint = share[0][:, : seen.regimes.parts].sum(axis=1)
    concentration = _concentration(seen, share[0], of_joint)
    q = _false_discovery(_p_values(seen, level, reference, explained, acting, limits))

    def location(place: int, r: int, rank: float) -> Location:
        return Location(
            channel,
            joints[place],
            seen.regimes.names[r],
            follows[place],
            (),
            share=float(min(share[0, place, r], 1.0)),
            share_interval=_interval(drawn_share[:, place, r]),
            excess=float(excess[0, place, r]),
            excess_interval=_interval(drawn_excess[:, place, r]),
            concentration=float(concentration[place, r]),
            q=float(q[place, r]),
            rank=rank,
        )

    found = [
        location(
            place,
            r,
            float(share[0, place, r] * np.sqrt(concentration[place, r]))
            * (1.0 if _suits(follows[place], regime) else limits.unsuited),
        )
        for place in range(len(joints))
        for r, regime in enumerate(seen.regimes.names)
        if share[0, place, r] >= LEAST_SHARE and q[place, r] <= FALSE_PLACES
    ]
    if acting is not None and acts is not None:
        sure = {one.joint for one in found}
        unsure = [place for place in range(len(joints)) if acting[place] and joints[place] not in sure]
        found += [location(place, r, rank) for place in unsure for r, rank in _where_added(acts, place)]
    if leaving is not None and joints[leaving] not in {one.joint for one in found}:
        foremost = np.flatnonzero((concentration[leaving] > 1) & (share[0, leaving] >= LEAST_SHARE))
        found += [location(leaving, int(r), float(share[0, leaving, r])) for r in foremost]
    found = [one for one in found if one.regime != LOADED or one.follows in _LOADS]
    last = np.zeros(len(joints), dtype=bool) if acting is None else ~acting
    order = {joint: (bool(last[place]), -of_joint[place]) for place, joint in enumerate(joints)}
    return sorted(found, key=lambda location: (order[location.joint], -location.rank))[: limits.most]


def _suits(follows: str | None, regime: str) -> bool:
    return regime in _SUITS.get(follows or "", (regime,))


def _where_added(acts: Map, place: int) -> list[tuple[int, float]]:
    """Return the regimes to which causes add more than on average, with their rank."""
    squares = acts.squares.sum(axis=0)
    of_place = squares[:, : acts.regimes.parts].sum(axis=1)
    if not of_place[place]:
        return []
    concentration = _concentration(acts, squares, of_place)[place]
    share = squares[place] / of_place[place]
    return [(int(r), float(share[r] * np.sqrt(concentration[r]))) for r in np.flatnonzero(concentration > 1)]


def _concentration(seen: Map, share: np.ndarray, of_joint: np.ndarray) -> np.ndarray:
    counts = seen.counts.sum(axis=0)
    part = counts / np.maximum(counts[:, : seen.regimes.parts].sum(axis=1, keepdims=True), 1)
    within = np.divide(share, of_joint[:, None], out=np.zeros_like(share), where=of_joint[:, None] > 0)
    return np.asarray(np.divide(within, part, out=np.zeros_like(share), where=part > 0))


def standing_out(traces: Sequence[Trace], place: int, level: float, limits: Places) -> tuple[str, ...]:
    """Return the runs whose mean square stands out over a level, the worst first."""
    squares = {trace.motion.run: trace.residual[:, place] ** 2 for trace in traces}
    means = {run: float(np.nanmean(own)) for run, own in squares.items() if np.isfinite(own).any()}
    above = [run for run, mean in means.items() if mean > limits.run_stands_out * level]
    return tuple(sorted(above, key=lambda run: -means[run]))


def _shares(seen: Map, level: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shares of the excess and the mean excess, (B, g, R) each, units weighted by (B, U)."""
    squares = np.einsum("bu,ugr->bgr", weights, seen.squares) / level
    counts = np.einsum("bu,ugr->bgr", weights, seen.counts)
    total = np.maximum(squares - counts, 0.0)
    whole = total[..., : seen.regimes.parts].sum(axis=(1, 2), keepdims=True)
    share = np.divide(total, whole, out=np.zeros_like(total), where=whole > 0)
    return share, np.divide(squares, counts, out=np.ones_like(total), where=counts > 0) - 1


def _p_values(
    seen: Map,
    level: np.ndarray,
    reference: Map | None,
    explained: Map | None,
    acting: np.ndarray | None,
    limits: Places,
) -> np.ndarray:
    """Return one-sided p-values of the excess, (g, R); NaN where too few units tell."""
    fewest = limits.fewest_samples
    mean, variance, freedom = _moments(_logarithms(seen, level, fewest))
    if reference is not None:
        _, other, of_other = _moments(_logarithms(reference, level, fewest))
        parts = variance**2 / np.maximum(freedom, 1) + np.where(of_other > 0, other**2 / np.maximum(of_other, 1), 0.0)
        variance = variance + np.where(of_other > 0, other, 0.0)
        freedom = np.where(freedom > 0, variance**2 / np.maximum(parts, np.finfo(float).tiny), 0)
    beyond = _student(mean, variance, freedom)
    if explained is None or acting is None:
        return beyond
    closed = _student(*_moments(_logarithms(seen, level, fewest) - _logarithms(explained, level, fewest)))
    either = np.minimum(2 * np.fmin(beyond, closed), 1.0)  # Bonferroni
    return np.asarray(np.where(acting[:, None], either, beyond))


def _student(mean: np.ndarray, variance: np.ndarray, freedom: np.ndarray) -> np.ndarray:
    p = t.sf(mean / np.sqrt(np.maximum(variance, np.finfo(float).tiny)), np.maximum(freedom, 1))
    return np.asarray(np.where(freedom > 0, p, np.nan))


def _logarithms(one: Map, level: np.ndarray, fewest: int) -> np.ndarray:
    """Return the logarithm of mean square over level, (U, g, R); NaN of units with too few samples."""
    enough = one.counts >= fewest
    expected = one.counts * np.where(enough, level, 1.0)  # a level may be infinite where there are no samples
    ratio = np.divide(one.squares, expected, out=np.ones_like(one.squares), where=enough)
    return np.where(enough, np.log(np.maximum(ratio, np.finfo(float).tiny)), np.nan)


def _moments(values: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mean over units (U, ...), its variance, and the degrees of freedom."""
    known = np.isfinite(values)
    number = np.maximum(known.sum(axis=0), 1)
    mean = np.where(known, values, 0.0).sum(axis=0) / number
    spread = np.where(known, (values - mean) ** 2, 0.0).sum(axis=0)
    freedom = np.maximum(known.sum(axis=0) - 1, 0)
    return mean, spread / np.maximum(freedom, 1) / number, freedom


def _false_discovery(p: np.ndarray) -> np.ndarray:
    """Return the rate of false discoveries at which each is one; 1 where p is not known."""
    known = np.isfinite(p)
    q = np.ones(p.shape)
    if known.any():
        q[known] = false_discovery_control(p[known])
    return q


def _interval(drawn: np.ndarray) -> tuple[float, float]:
    low, high = np.quantile(drawn, [0.025, 0.975])
    return float(low), float(high)
