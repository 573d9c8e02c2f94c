"""Causes at further joints, where runs are few and the twin makes up for them with a number that cannot be.

The search fits the twin without bounds. Where an effect is missing at a joint, friction below none may make up for it,
so that the effect explains next to nothing. With the twin's number held at its bound it does, but perhaps in one run
and not in another, where a t between few stretches says nothing: what repeats within runs tells.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from irtwin.effects.catalogue import BASELINE
from irtwin.gap.isolation.cause import Cause, gains, judged, rows
from irtwin.gap.isolation.finding import Finding
from irtwin.gap.isolation.repeating import repeating
from irtwin.gap.regression.cross_validation import Projected, Trial, attempt, scores
from irtwin.gap.regression.hypotheses import MISSING, Hypothesis, Variant
from irtwin.gap.regression.moments import summed
from irtwin.gap.regression.normal_equations import twin_values
from irtwin.gap.regression.significance import FINE, likeness, p_values
from irtwin.gap.regression.transient import is_transient
from irtwin.gap.thresholds import Selection

_HELD = 1e-9  # of its spread: by so little a coefficient that is held moves


def at_further_joints(
    finding: Finding, causes: Sequence[Cause], memories: Mapping[str, np.ndarray], limits: Selection, seed: int
) -> tuple[Cause, ...]:
    """Return some causes of a finding, each at the joints too where it is shown beside a twin whose numbers can be.

    memories: by effect, (g,) for how long, s, what is left without it is correlated. There the effect has to explain as
    much as at any second joint and lead, where it does not beside the twin as the search fits it; chance must seldom
    reach it, and halves of the time must agree on its size. Of what explains enough as it is, the search has judged.
    """
    if finding.name != "torque":
        return tuple(causes)
    beside = replace(finding, attribution=replace(finding.attribution, causes=tuple(causes)))
    below = _below_lowest(beside)
    tried = [one for one in _elsewhere(beside, limits.alpha) if one.joint in below]
    if tried:
        least = limits.second_joint_gain * limits.least_gain
        tried = [one for one, gain in zip(tried, _tried(beside, tried)[0], strict=True) if gain < least]
    if not tried:
        return tuple(causes)
    held = [k for joint in dict.fromkeys(one.joint for one in tried if one.joint) for k in below[joint]]
    judge = _Judge(_holding(beside, held), tried, memories, limits, seed)
    found = judge.found()
    return tuple(_with(cause, [one for one in found if one.of(cause)]) for cause in causes)


@dataclass(frozen=True)
class _Shown:
    """A hypothesis in the shape that the data choose; p: adjusted for all that were tried at further joints."""

    hypothesis: Hypothesis
    variant: Variant
    p: float

    def of(self, cause: Cause) -> bool:
        return (self.hypothesis.effect, self.hypothesis.scope) == (cause.effect, cause.scope)


@dataclass(frozen=True)
class _Judge:
    """Judges hypotheses beside a finding whose twin is held where it would be below its bounds."""

    finding: Finding
    tried: Sequence[Hypothesis]
    memories: Mapping[str, np.ndarray]
    limits: Selection
    seed: int

    def found(self) -> list[_Shown]:
        """Return those that are shown."""
        finding, limits, system = self.finding, self.limits, self.finding.system
        joints = {one.joint for one in self.tried}
        rivals = [one for one in _free(finding) if one.joint in joints]
        gain, trial = _tried(finding, rivals)
        variants = [variant for one in rivals for variant in one.variants]
        noise = finding.attribution.noise
        said = scores(system, system.moments(noise), noise, finding.chosen)
        shown = []
        for one, own, place in zip(rivals, gain, trial.best, strict=True):
            if one not in self.tried or own < limits.second_joint_gain * limits.least_gain:
                continue
            best = max(other for other, rival in zip(gain, rivals, strict=True) if rival.joint == one.joint)
            plain = one.effect in BASELINE and one.scope == MISSING
            if own < (limits.plain_first if plain else limits.leads_too) * best:
                continue
            variant = variants[int(place)]
            p = self._p(one, variant, said)
            if p <= limits.alpha and self._agree(one, variant):
                shown.append(_Shown(one, variant, p))
        return shown

    def _p(self, one: Hypothesis, variant: Variant, said: tuple[np.ndarray, Projected]) -> float:
        system = self.finding.system
        memory = float(self.memories[one.effect][system.equations(variant.columns)].max())
        alike = likeness(system.blocks, memory)
        return float(p_values(*said, self.tried, self.seed, alike, FINE)[list(self.tried).index(one)])

    def _agree(self, one: Hypothesis, variant: Variant) -> bool:
        """Return whether halves of the time give it the same size, as they seldom would by chance."""
        new = Cause(one.effect, one.scope, (one.joint or "",), (variant,), gain=0.0, t=0.0, p=0.0)
        found = self.finding.attribution
        beside = replace(self.finding, attribution=replace(found, causes=(*found.causes, new)))
        sizes = repeating(beside, self.limits)[-1]
        return sizes is not None and sizes.p <= self.limits.alpha


def _tried(finding: Finding, hypotheses: Sequence[Hypothesis]) -> tuple[list[float], Trial]:
    """Return what each hypothesis gains a row on groups left out, beside the causes, and the whole trial."""
    system = finding.system
    moments = system.moments(finding.attribution.noise)
    trial = attempt(system, moments, finding.chosen, [one.variants for one in hypotheses])
    weights = rows(system)
    counts = [judged(system, one.scope) for one in hypotheses]
    each = zip(gains(system, trial), counts, strict=True)
    return [float(np.average(gain[mine], weights=weights[mine])) for gain, mine in each], trial


def _with(cause: Cause, more: Sequence[_Shown]) -> Cause:
    """Return a cause at more joints; gain and t stay those of the joints where the search found it."""
    return replace(
        cause,
        joints=(*cause.joints, *(one.hypothesis.joint for one in more if one.hypothesis.joint)),
        variants=(*cause.variants, *(one.variant for one in more)),
        p=max([cause.p, *(one.p for one in more)]),
    )


def _below_lowest(finding: Finding) -> dict[str, list[int]]:
    """Return, by joint, the twin's coefficients that a fit without bounds puts below their lowest values."""
    system = finding.system
    noise = system.residual_rms(finding.chosen, finding.attribution.noise)
    values = twin_values(system, system.solution(finding.chosen, summed(system.moments(noise))))
    found: dict[str, list[int]] = {}
    for k, (_, term) in enumerate(system.terms):
        if term.joint is not None and values[k] < term.lowest:
            found.setdefault(term.joint, []).append(k)
    return found


def _free(finding: Finding) -> list[Hypothesis]:
    """Return the hypotheses of which no cause has a column."""
    taken = set(finding.chosen)
    return [h for h in finding.attribution.hypotheses if not any(set(v.columns) & taken for v in h.variants)]


def _elsewhere(finding: Finding, alpha: float) -> list[Hypothesis]:
    """Return the hypotheses of the causes' effects at the joints where these were not found.

    What stands by more than `alpha` where residuals remember goes no further. Nor does what friction of another form
    imitates: it would have to explain a part of the floor.
    """
    known = {
        (cause.effect, cause.scope): cause.joints
        for cause in finding.causes
        if cause.joints and cause.p_remembered is not None and cause.p_remembered <= alpha
        if not any(variant.effect.imitated or is_transient(variant.effect) for variant in cause.variants)
    }
    return [
        one for one in _free(finding) if one.joint and one.joint not in known.get((one.effect, one.scope), (one.joint,))
    ]


def _holding(finding: Finding, held: Sequence[int]) -> Finding:
    """Return a finding in whose equations some of the twin's coefficients stay at their lowest values."""
    system, terms = finding.system, list(finding.system.terms)
    for k in held:
        effect, term = terms[k]
        terms[k] = (effect, replace(term, expected=term.lowest, spread=term.spread * _HELD))
    known = system.prior_rows
    if known is not None:
        known = known.copy()
        known[:, list(held)] = 0.0
        known = np.concatenate([known, np.eye(system.base)[list(held)]])
    bounded = replace(system, terms=tuple(terms), prior_rows=known)
    noise = bounded.residual_rms(finding.chosen, finding.attribution.noise)
    return replace(finding, system=bounded, attribution=replace(finding.attribution, noise=noise))
