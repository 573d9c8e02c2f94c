"""Ambiguity groups: the causes that selected hypotheses make together, and which effects would explain them as well."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.gap.isolation.cause import Cause, Find, between_groups, gains, judged, rows
from irtwin.gap.regression.cross_validation import attempt, canonical_correlation
from irtwin.gap.regression.hypotheses import Hypothesis, Variant
from irtwin.gap.regression.moments import Moments, summed
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.transient import is_transient
from irtwin.gap.thresholds import Ambiguity, Thresholds
from irtwin.identification.progress import Tell, paced

_Parts = tuple[Variant, ...]


def causes(
    system: System,
    moments: Sequence[Moments],
    noise: np.ndarray,
    candidates: Sequence[Hypothesis],
    found: Sequence[Find],
    limits: Thresholds,
    tell: Tell | None = None,
) -> tuple[Cause, ...]:
    """Join the finds of one effect and scope into causes, look for rivals of each, and rank them.

    One that explains next to nothing of what the largest does, in its own equations, is not named: it makes up for the
    form of the largest. `noise` (g,) is what weighs the `moments`.
    """
    keys = list(dict.fromkeys((one.hypothesis.effect, one.hypothesis.scope) for one in found))
    joined: list[Cause] = []
    for key in keys:
        members = [one for one in found if (one.hypothesis.effect, one.hypothesis.scope) == key]
        others = [k for one in found if one not in members for k in one.variant.columns]
        joined.append(_cause(system, moments, candidates, members, others, limits, tell))
    if not joined:
        return ()
    joined.sort(key=lambda one: -one.gain)
    alone = _in_equations(system, moments, noise, joined, paced(tell))
    least = [limits.ambiguity.least_share * float(alone[system.equations(one.columns)].sum()) for one in joined]
    return tuple(one for one, needed in zip(joined, least, strict=True) if one is joined[0] or one.gain >= needed)


def _in_equations(
    system: System, moments: Sequence[Moments], noise: np.ndarray, named: Sequence[Cause], told: Tell
) -> np.ndarray:
    """Return (g,) what the first cause explains of each equation beside the others, a row, on groups left out."""
    rest = [k for cause in named[1:] for k in cause.columns]
    every = [*named[0].columns, *rest]
    total = summed(moments)
    gain = np.zeros(len(system.pattern))
    for group in np.flatnonzero(judged(system, named[0].scope)).tolist():
        told(f"  what the first cause explains, group {group + 1} of {len(moments)} left out")
        train = total - moments[group]
        gain += system.squares(system.solution(rest, train), group) - system.squares(
            system.solution(every, train), group
        )
    return np.asarray(np.maximum(gain, 0.0) / noise**2 / rows(system)[judged(system, named[0].scope)].sum())


def _cause(
    system: System,
    moments: Sequence[Moments],
    candidates: Sequence[Hypothesis],
    members: Sequence[Find],
    others: Sequence[int],
    limits: Thresholds,
    tell: Tell | None,
) -> Cause:
    effect, scope = members[0].hypothesis.effect, members[0].hypothesis.scope
    mine: _Parts = tuple(one.variant for one in members)
    competing = _competing(system, moments, candidates, members, others, tell)
    sides = [mine, *(parts for _, parts in competing)]
    own = judged(system, scope)
    trial = attempt(system, moments, others, [[as_one(parts)] for parts in sides], tell)
    gain, said = gains(system, trial)[:, own], (trial.said[0] / rows(system))[own]
    mean = np.average(gain, axis=1, weights=rows(system)[own])
    alike = canonical_correlation(system, summed(moments), others, [as_one(parts).columns for parts in sides])
    known: dict[str, float] = {}
    correlations: dict[str, float] = {}
    equal: list[str] = []
    for k, (name, _) in enumerate(competing, start=1):
        if name == effect:
            continue
        if mean[k] > known.get(name, -np.inf):
            known[name], correlations[name] = float(mean[k]), float(alike[k])
        if mean[0] - mean[k] < indistinguishable_below(
            gain[0] - gain[k], float(mean[0]), 1 - limits.ambiguity.rival_gain, limits.ambiguity
        ):
            equal.append(name)
    return Cause(
        effect=effect,
        scope=scope,
        joints=tuple(one.hypothesis.joint for one in members if one.hypothesis.joint),
        variants=mine,
        gain=float(mean[0]),
        t=members[0].t
        if is_transient(mine[0].effect)
        else between_groups(gain[0], said, limits.selection),  # an episode's is between joints
        p=max(one.p for one in members),
        rivals=tuple(dict.fromkeys(sorted(equal, key=lambda name: -known[name]))),
        rival_gains=known,
        rival_correlations=correlations,
    )


def indistinguishable_below(behind: np.ndarray, gain: float, most: float, limits: Ambiguity) -> float:
    """Return by how much an effect must be behind a better one to be told from it.

    behind: (G,) it is in each group, of the better one's `gain`; more than `most` of that always tells.
    """
    error = float(np.std(behind, ddof=1)) / np.sqrt(len(behind)) if len(behind) > 1 else 0.0
    return max(limits.no_difference * gain, min(limits.apart * error, most * gain))


def _competing(
    system: System,
    moments: Sequence[Moments],
    candidates: Sequence[Hypothesis],
    members: Sequence[Find],
    others: Sequence[int],
    tell: Tell | None,
) -> list[tuple[str, _Parts]]:
    """Return what could stand where the members do: other effects at the same joints, or of the whole robot."""
    joints = tuple(one.hypothesis.joint for one in members if one.hypothesis.joint)
    mine = (members[0].hypothesis.effect, members[0].hypothesis.scope)
    free = [h for h in candidates if not any(set(v.columns) & set(others) for v in h.variants)]
    best = attempt(system, moments, others, [h.variants for h in free], tell).best
    variants = [variant for h in free for variant in h.variants]
    choice = {(h.effect, h.scope, h.joint): variants[k] for h, k in zip(free, best, strict=True)}
    competing: list[tuple[str, _Parts]] = []
    for name, scope in dict.fromkeys((h.effect, h.scope) for h in free):
        for places in dict.fromkeys([joints, (None,)]):
            parts = [choice.get((name, scope, joint)) for joint in places]
            if parts and (name, scope) != mine and all(part is not None for part in parts):
                competing.append((name, tuple(part for part in parts if part is not None)))
    return competing


def as_one(parts: Sequence[Variant]) -> Variant:
    """Return one variant with the columns of several, of one effect."""
    columns = tuple(k for part in parts for k in part.columns)
    return Variant(parts[0].effect, columns, tuple(term for part in parts for term in part.terms))
