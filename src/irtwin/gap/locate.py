"""Where the gap lies: the joints and regimes whose residual is beyond the noise floor, and what is sure of it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.stats import false_discovery_control, t

from irtwin.gap.excess_map import FEWEST, Map
from irtwin.gap.residuals import Trace

_DISCOVERIES = 0.05  # expected share of false ones among the places
_LEAST_SHARE = 0.02
_PLACES = 12
_STANDS_OUT = 1.5  # times the floor's square
_RESAMPLED = 1000


@dataclass(frozen=True)
class Location:
    """A place of the gap: the excess of its mean square over the floor's, with 95 % intervals over runs.

    `share` of the channel's whole excess; places that overlap (`loaded` with all others) share it. `q`: the rate of
    false discoveries at which the place is found. `concentration`: the place's share over its share of the samples.
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

    @property
    def rank(self) -> float:
        """What ranks it: its share, and how concentrated the gap is there."""
        return float(self.share * np.sqrt(self.concentration))

    def to_json(self) -> dict[str, Any]:
        """Return the location in the form of the schema, with what is sure of it besides."""
        return {
            "channel": self.channel,
            "joint": self.joint,
            "regime": self.regime,
            "follows": self.follows,
            "runs": list(self.runs),
            "share": self.share,
            "share_interval95": list(self.share_interval),
            "excess": self.excess,
            "excess_interval95": list(self.excess_interval),
            "concentration": self.concentration,
            "false_discovery_rate": self.q,
        }


def locate(
    channel: str,
    joints: Sequence[str | None],
    seen: Map,
    level: np.ndarray,
    reference: Map | None = None,
    seed: int = 0,
) -> list[Location]:
    """Return the places whose excess over the `level` (g, R) is beyond chance, the foremost first.

    The false discovery rate over places is held at 5 % (Benjamini and Hochberg); p-values are Student's over units,
    of the mean squares' excess, against those of the reference where there is one. `follows` and `runs` are empty.
    """
    share, excess = _shares(seen, level, np.ones((1, len(seen.squares))))
    rng = np.random.default_rng(seed)
    weights = rng.multinomial(len(seen.squares), np.full(len(seen.squares), 1 / len(seen.squares)), _RESAMPLED)
    drawn_share, drawn_excess = _shares(seen, level, weights.astype(float))
    counts = seen.counts.sum(axis=0)
    part = counts / np.maximum(counts[:, : seen.regimes.parts].sum(axis=1, keepdims=True), 1)
    within = share[0] / np.maximum(share[0][:, : seen.regimes.parts].sum(axis=1, keepdims=True), np.finfo(float).tiny)
    q = _false_discovery(_p_values(seen, level, reference))
    found = [
        Location(
            channel,
            joint,
            regime,
            None,
            (),
            share=float(min(share[0, place, r], 1.0)),
            share_interval=_interval(drawn_share[:, place, r]),
            excess=float(excess[0, place, r]),
            excess_interval=_interval(drawn_excess[:, place, r]),
            concentration=float(within[place, r] / part[place, r]),
            q=float(q[place, r]),
        )
        for place, joint in enumerate(joints)
        for r, regime in enumerate(seen.regimes.names)
        if share[0, place, r] >= _LEAST_SHARE and q[place, r] <= _DISCOVERIES
    ]
    return sorted(found, key=lambda location: -location.rank)[:_PLACES]


def standing_out(traces: Sequence[Trace], place: int, level: float) -> tuple[str, ...]:
    """Return the runs whose mean square stands out over a level, the worst first."""
    means = {trace.motion.run: float(np.nanmean(trace.residual[:, place] ** 2)) for trace in traces}
    above = [run for run, mean in means.items() if mean > _STANDS_OUT * level]
    return tuple(sorted(above, key=lambda run: -means[run]))


def _shares(seen: Map, level: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return the shares of the excess and the mean excess, (B, g, R) each, units weighted by (B, U)."""
    squares = np.einsum("bu,ugr->bgr", weights, seen.squares) / level
    counts = np.einsum("bu,ugr->bgr", weights, seen.counts)
    total = np.maximum(squares - counts, 0.0)
    whole = total[..., : seen.regimes.parts].sum(axis=(1, 2), keepdims=True)
    share = np.divide(total, whole, out=np.zeros_like(total), where=whole > 0)
    return share, np.divide(squares, counts, out=np.ones_like(total), where=counts > 0) - 1


def _p_values(seen: Map, level: np.ndarray, reference: Map | None) -> np.ndarray:
    """Return one-sided p-values of the excess, (g, R); NaN where too few units tell."""
    own = _moments(seen, level)
    other = _moments(reference, level) if reference is not None else None
    mean, error, freedom = own
    with np.errstate(invalid="ignore", divide="ignore"):
        excess = mean - 1
        if other is not None and np.isfinite(other[1]).any():
            spread = np.nan_to_num(other[1])
            total = error**2 + spread**2
            parts = error**4 / freedom + np.where(spread > 0, spread**4 / other[2], 0.0)
            error, freedom = np.sqrt(total), total**2 / parts
        p = t.sf(excess / np.maximum(error, np.finfo(float).tiny), freedom)
    return np.asarray(np.where(np.isfinite(error) & (freedom > 0), p, np.nan))


def _moments(one: Map, level: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the mean over units of the mean squares over the level, its standard error, and degrees of freedom."""
    enough = one.counts >= FEWEST
    with np.errstate(invalid="ignore", divide="ignore"):
        values = np.where(enough, one.squares / one.counts / level, np.nan)
        number = enough.sum(axis=0)
        mean = np.nansum(values, axis=0) / number
        spread = np.nansum(np.where(enough, (values - mean) ** 2, 0.0), axis=0) / (number - 1)
        error = np.where(number > 1, np.sqrt(spread / number), np.nan)
    return mean, error, np.maximum(number - 1, 0)


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
