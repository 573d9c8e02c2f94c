"""Whether causes stand where residuals remember and runs are few: stretches of a run are then fewer than they look.

The search draws signs for blocks of time, and compares stretches of a run, as if these were independent. A cause that
passes is judged again, with blocks as alike as what is left without it is correlated, and by whether halves of the time
agree on it; it is then looked for at further joints. Where each programmed motion is a group, runs that know nothing of
each other agree on a cause, and nothing is to be judged again.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.explained import Explained
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.isolation.further_joints import at_further_joints
from irtwin.gap.isolation.repeating import Repeats, repeating
from irtwin.gap.regression.channel_equations import Torque
from irtwin.gap.regression.correlation import correlation_samples
from irtwin.gap.regression.cross_validation import scores
from irtwin.gap.regression.hypotheses import Hypothesis, Variant
from irtwin.gap.regression.residuals import as_filtered, power_traces, torque_traces
from irtwin.gap.regression.significance import FINE, likeness, p_values
from irtwin.gap.regression.transient import is_transient
from irtwin.gap.thresholds import Selection
from irtwin.signals.filter import decimation
from irtwin.signals.motion import Motion


def standing(
    explained: Explained, motions: Sequence[Motion], torque: Torque, limits: Selection, seed: int
) -> tuple[Cause, ...]:
    """Return the causes that chance does not reach where residuals remember, with what was found of each.

    `torque` as for the channel's traces. An episode is not judged: joints agree on it, not blocks. Nor are bodies, nor
    what is so rare that no t tells.
    """
    finding = explained.finding
    if not finding.causes or not _cut(finding):
        return finding.causes
    remembered = memory(explained, motions, torque)
    told = zip(finding.causes, remembered, repeating(finding, limits), strict=True)
    judged = (_judged(finding, *each, limits, seed) for each in told)
    kept = [cause for cause in judged if cause is not None]
    by_effect = {cause.effect: memories for cause, memories in zip(finding.causes, remembered, strict=True)}
    return at_further_joints(finding, kept, by_effect, limits, seed)


def _cut(finding: Finding) -> bool:
    """Return whether groups are stretches of runs."""
    groups = [set(runs) for runs in finding.groups]
    return any(one & other for k, one in enumerate(groups) for other in groups[:k])


def _judged(
    finding: Finding, cause: Cause, memories: np.ndarray, repeats: Repeats | None, limits: Selection, seed: int
) -> Cause | None:
    """Return a cause with its p and how far it repeats, None where it may be chance.

    It is none where random signs, alike where residuals are, seldom reach it, or where halves of the time agree on it
    as they seldom would on the best of as many by chance.
    """
    system, effect = finding.system, cause.variants[0].effect
    if cause.of_bodies or is_transient(effect) or (effect.rare and cause.t < limits.least_t):
        return cause
    alike = likeness(system.blocks, float(memories[system.equations(cause.columns)].max()))
    short = cause.t >= limits.least_t > cause.t * _shrunk(alike, system.group)
    p = 1.0 if short else _p(finding, cause, alike, seed)
    if repeats is not None:
        p = min(p, repeats.p)
    if p > limits.alpha_where_remembered:
        return None
    if repeats is None:
        return replace(cause, p_remembered=p)
    return replace(cause, p_remembered=p, repeats=repeats.part, in_halves=repeats.shown)


def _shrunk(alike: np.ndarray, group: np.ndarray) -> float:
    """Return by how much a t between groups is less where groups are stretches of a run, each like the next."""
    same = group[:, None] == group
    return float(np.sqrt(alike[same].sum() / alike.sum()))


def memory(explained: Explained, motions: Sequence[Motion], torque: Torque) -> list[np.ndarray]:
    """Return, for each cause, (g,) for how long, s, what the twin and the other causes leave is correlated.

    Of each equation; the median over runs, so that no odd run decides.
    """
    finding, stack = explained.finding, explained.stack
    traces = (torque_traces if finding.name == "torque" else power_traces)(
        stack, motions, lambda run: explained.values, torque
    )
    found: list[list[list[float]]] = [[] for _ in finding.causes]
    for trace in traces:
        shape = trace.residual.shape
        parts = [as_filtered(trace.motion, explained.added(one, trace.motion)).reshape(shape) for one in finding.causes]
        step = decimation(trace.motion.rate, trace.motion.cutoff) if trace.motion.cutoff else 1
        for own, part in zip(found, parts, strict=True):
            left = (trace.residual - sum(parts) + part)[::step]
            own.append([correlation_samples(one) * step / trace.motion.rate for one in left.T])
    return [np.asarray(np.median(own, axis=0)) for own in found]


def _p(finding: Finding, cause: Cause, alike: np.ndarray, seed: int) -> float:
    """Return the p-value of a cause beside the others, adjusted for the catalogue."""
    system, noise = finding.system, finding.attribution.noise
    others = [k for one in finding.causes if one is not cause for k in one.columns]
    columns, terms = cause.columns, tuple(term for one in cause.variants for term in one.terms)
    whole = Hypothesis(cause.effect, None, cause.scope, (Variant(cause.variants[0].effect, columns, terms),))
    rest = [
        one
        for one in finding.attribution.hypotheses
        if not any(set(variant.columns) & {*others, *columns} for variant in one.variants)
    ]
    block_scores, products = scores(system, system.moments(noise), noise, others)
    return float(p_values(block_scores, products, [whole, *rest], seed, alike, FINE)[0])
