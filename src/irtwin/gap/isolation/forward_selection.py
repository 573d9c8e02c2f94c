"""Which effects explain the gap: forward selection on groups left out, rivals, and what each cause closes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.effects.catalogue import BASELINE
from irtwin.effects.effect import Effect
from irtwin.gap.isolation.ambiguity_groups import causes, indistinguishable_below
from irtwin.gap.isolation.cause import Cause, Find, between_groups, gains, judged, rows
from irtwin.gap.regression.cross_validation import Trial, attempt, scores
from irtwin.gap.regression.hypotheses import MISSING, Hypothesis, in_scope
from irtwin.gap.regression.moments import Moments
from irtwin.gap.regression.normal_equations import System
from irtwin.gap.regression.significance import p_values
from irtwin.gap.regression.transient import is_transient
from irtwin.gap.thresholds import Selection, Thresholds
from irtwin.identification.progress import Tell, paced

_ROUNDS = 12


@dataclass(frozen=True)
class Attribution:
    """The causes found, ranked by gain; `noise` (g,) what they leave; `visible` of each hypothesis before any."""

    causes: tuple[Cause, ...]
    noise: np.ndarray
    hypotheses: tuple[Hypothesis, ...]
    visible: np.ndarray
    share_visible: np.ndarray


def attribute(
    system: System,
    candidates: Sequence[Hypothesis],
    seed: int,
    limits: Thresholds,
    floor: np.ndarray | None = None,
    tell: Tell | None = None,
) -> Attribution:
    """Find the effects that the data show beyond the twin's.

    Each round tries every hypothesis beside those chosen, refits everything, and judges it on groups left out; an
    episode by what its joints say of each other. With a `floor` (g,), RMS, some causes have to explain a part of it.
    `tell` is told how far that has come, where it takes long.
    """
    candidates = in_scope(candidates, both=system.both)
    told = paced(tell)
    told("  what the twin leaves")
    noise = system.residual_rms((), np.ones(len(system.pattern)))
    told("  what the twin leaves")
    noise = system.residual_rms((), noise)
    moments = system.moments(noise)
    first = attempt(system, moments, (), [h.variants for h in candidates], tell)
    search = _Search(system, candidates, seed, floor, limits, told)
    found = _swapped(search, search.forward([], noise), noise)
    noise = search.noise(found, noise)
    moments = system.moments(noise)
    least = search.matters(noise, [one.hypothesis for one in found]) / 2
    found = _backward(system, moments, found, least, limits.selection)
    search.tell(f"  rivals of the {len(found)} that are found")
    named = causes(system, moments, noise, candidates, found, limits, search.tell)
    noise = system.residual_rms([k for cause in named for k in cause.columns], noise)
    return Attribution(named, noise, tuple(candidates), first.visible, first.share_visible)


@dataclass(frozen=True)
class _Search:
    """Forward selection on one system."""

    system: System
    candidates: Sequence[Hypothesis]
    seed: int
    floor: np.ndarray | None
    limits: Thresholds
    tell: Tell

    def matters(self, noise: np.ndarray, left: Sequence[Hypothesis]) -> np.ndarray:
        """Return what each has to gain, (H,), where equations are weighed by `noise` (g,)."""
        least = np.full(len(left), self.limits.selection.least_gain)
        if self.floor is None:
            return least
        floor = np.minimum(self.floor / noise, 1.0) ** 2  # of the residual's square where that is below it
        for k, one in enumerate(left):
            share = self.share_of_floor(one.variants[0].effect)
            if share:
                least[k] = max(
                    self.limits.selection.least_gain,
                    share * float(floor[self.system.equations(one.variants[0].columns)].max()),
                )
        return least

    def share_of_floor(self, effect: Effect) -> float:
        """Return which part of a floor's square a cause explains at least: what forms that differ leave is no cause."""
        limits = self.limits.selection
        if effect.signal == "power":
            return limits.least_of_floor_in_power
        return limits.least_of_floor_imitated if effect.imitated else 0.0

    def noise(self, found: Sequence[Find], before: np.ndarray) -> np.ndarray:
        """Return what finds leave of each equation, (g,) RMS; `before` weighs the equations."""
        return self.system.residual_rms(_columns(found), before)

    def forward(self, found: Sequence[Find], noise: np.ndarray) -> list[Find]:
        """Add to the finds, round by round, until nothing more is sure."""
        all_found = list(found)
        for _ in range(_ROUNDS):
            self.tell(f"  what the {len(all_found)} that are found leave")
            if all_found:
                noise = self.noise(all_found, noise)
            moments = self.system.moments(noise)
            self.tell(f"  {len(self.candidates)} hypotheses, beside {len(all_found)} that are found")
            new = self._round(moments, noise, all_found) or self._elsewhere(moments, noise, all_found)
            if not new:
                break
            all_found.extend(new)
        return all_found

    def _round(self, moments: Sequence[Moments], noise: np.ndarray, found: Sequence[Find]) -> list[Find]:
        chosen, limits = _columns(found), self.limits.selection
        left = self._left(found)
        if not left:
            return []
        trial = attempt(self.system, moments, chosen, [h.variants for h in left], self.tell)
        gain, t, speaks = _judged(self.system, trial, left, self.limits.selection)
        transient = self.system.transient
        short = [k for k, one in enumerate(left) if transient and any(is_transient(v.effect) for v in one.variants)]
        t[short] = transient.t if transient else 0.0
        alone = _far_ahead(gain, speaks <= limits.few_groups, left, limits)
        plausible = (gain >= self.matters(noise, left)) & ((t >= limits.least_t) | alone)
        if not plausible.any():
            return []
        self.tell("  whether chance reaches what they gain")
        block_scores, products = scores(self.system, moments, noise, chosen, self.tell)
        self.tell("  whether chance reaches what they gain")
        p = p_values(block_scores, products, left, self.seed)
        p[short] = transient.p if transient else 1.0
        sure = np.flatnonzero(plausible & (_sure(p, gain, left, limits) | alone))
        if not len(sure):
            return []
        best = _leader(sure, gain, gains(self.system, trial), left, found, self.limits)
        return [_find(trial, left, k, gain, t, p) for k in [best, *_leads_too(best, sure, gain, left, limits)]]

    def _elsewhere(self, moments: Sequence[Moments], noise: np.ndarray, found: Sequence[Find]) -> list[Find]:
        """Return what the effects that were found add at other joints, which show it less."""
        known = {_key(one) for one in found if one.hypothesis.joint}
        left = [one for one in self._left(found) if one.joint and (one.effect, one.scope) in known]
        if not left:
            return []
        chosen, limits = _columns(found), self.limits.selection
        trial = attempt(self.system, moments, chosen, [h.variants for h in left], self.tell)
        gain, t, _ = _judged(self.system, trial, left, self.limits.selection)
        p = p_values(*scores(self.system, moments, noise, chosen, self.tell), left, self.seed)
        enough = np.where(
            [self.share_of_floor(one.variants[0].effect) > 0 for one in left], 1.0, limits.second_joint_gain
        )
        sure = (gain >= enough * self.matters(noise, left)) & (t >= limits.second_joint_t) & (p <= limits.alpha)
        return [_find(trial, left, int(k), gain, t, p) for k in np.flatnonzero(sure)]

    def _left(self, found: Sequence[Find]) -> list[Hypothesis]:
        taken = set(_columns(found))
        left = [h for h in self.candidates if not any(set(v.columns) & taken for v in h.variants)]
        return [h for h in left if not any(_same_place(h, one.hypothesis) for one in found)]

    def loss(self, found: Sequence[Find], moments: Sequence[Moments]) -> float:
        """Return the weighted squares that finds leave on groups left out."""
        return float(attempt(self.system, moments, _columns(found), [[found[0].variant]]).start.sum())


def _swapped(search: _Search, found: list[Find], noise: np.ndarray) -> list[Find]:
    """Search again without each cause in turn: what came first may have stood for two that were still unknown."""
    for key in list(dict.fromkeys(_key(one) for one in found)):
        rest = [one for one in found if _key(one) != key]
        if not rest or len(rest) == len(found):
            continue
        other = search.forward(rest, search.noise(rest, noise))
        if {_key(one) for one in other} == {_key(one) for one in found} or len(other) > len(found):
            continue
        moments = search.system.moments(search.noise(found, noise))
        if search.loss(other, moments) < search.loss(found, moments):
            found = other
    return found


def _key(one: Find) -> tuple[str, str]:
    return one.hypothesis.effect, one.hypothesis.scope


def _columns(found: Sequence[Find]) -> list[int]:
    return [k for one in found for k in one.variant.columns]


def _judged(
    system: System, trial: Trial, candidates: Sequence[Hypothesis], limits: Selection
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return each hypothesis' gain per row, its t between groups, and in how many it speaks; (H,), on those that count.

    In how many, effectively: (sum a)^2 / sum a^2 of what it adds to each.
    """
    gain, weights = gains(system, trial), rows(system)
    said = trial.said / weights
    own = [judged(system, hypothesis.scope) for hypothesis in candidates]
    mean = [np.average(one[mine], weights=weights[mine]) for one, mine in zip(gain, own, strict=True)]
    t = [between_groups(one[mine], adds[mine], limits) for one, adds, mine in zip(gain, said, own, strict=True)]
    speaks = [adds[mine].sum() ** 2 / max((adds[mine] ** 2).sum(), 1e-12) for adds, mine in zip(said, own, strict=True)]
    return np.array(mean), np.array(t), np.array(speaks)


def _far_ahead(gain: np.ndarray, few: np.ndarray, left: Sequence[Hypothesis], limits: Selection) -> np.ndarray:
    """Return (H,) whether an effect that is rare speaks in a `few` groups alone, gains most at its joint, and by far.

    A swing or a full bus may be excited in one run or two; friction that shows in one alone is a joint that sticks.
    What the effects that speak everywhere gain at most is what chance and forms that differ make.
    """
    found = np.zeros(len(gain), dtype=bool)
    rare = np.flatnonzero(few & [all(v.effect.rare for v in one.variants) for one in left])
    if len(rare):
        best = int(rare[np.argmax(gain[rare])])
        beside = max(gain[k] for k, one in enumerate(left) if _overlap(one, left[best]))
        common = [gain[k] for k in np.flatnonzero(~few).tolist() if not _same_place(left[k], left[best])]
        found[best] = gain[best] >= max(limits.rare_gain, limits.rare_lead * max(common, default=0.0), beside)
    return found


def _sure(p: np.ndarray, gain: np.ndarray, left: Sequence[Hypothesis], limits: Selection) -> np.ndarray:
    """Return (H,) whether a hypothesis is beyond chance."""
    bodies = np.array([one.of_bodies for one in left])  # too many for a score by column
    return np.asarray((p <= np.where(gain >= limits.large_gain, limits.alpha_of_large, limits.alpha)) | bodies)


def _leads_too(
    best: int, plausible: np.ndarray, gain: np.ndarray, left: Sequence[Hypothesis], limits: Selection
) -> list[int]:
    """Return the other joints' places where the leader's effect leads too, or nearly."""
    leader = left[best]
    robot = [gain[j] for j in plausible if left[j].joint is None]
    if leader.joint is None or (robot and max(robot) >= gain[best]):
        return []
    found = []
    for k in plausible:
        other = left[k]
        if k == best or other.effect != leader.effect or other.scope != leader.scope or other.joint is None:
            continue
        near = limits.plain_first if other.effect in BASELINE and other.scope == MISSING else limits.leads_too
        if gain[k] >= near * max(gain[j] for j in plausible if left[j].joint == other.joint):
            found.append(int(k))
    return found


def _leader(
    plausible: np.ndarray,
    gain: np.ndarray,
    per_group: np.ndarray,
    left: Sequence[Hypothesis],
    found: Sequence[Find],
    limits: Thresholds,
) -> int:
    """Return the place of the hypothesis to take: of those that do as well as the best, the least flexible.

    A form of the default twin that is missing goes before what refines it; an effect found before goes before another.
    """
    best = int(plausible[np.argmax(gain[plausible])])
    plain = [
        int(k)
        for k in plausible
        if left[k].effect in BASELINE
        and left[k].scope == MISSING == left[best].scope
        and left[k].joint == left[best].joint
        and gain[k] >= limits.selection.plain_first * gain[best]
    ]
    if plain:
        return max(plain, key=lambda k: gain[k])
    before = {(one.hypothesis.effect, one.hypothesis.scope) for one in found}
    known = [int(k) for k in plausible if (left[k].effect, left[k].scope) in before and left[k].joint]
    nearest = max(known, key=lambda k: gain[k], default=best)
    if nearest != best and gain[nearest] >= limits.ambiguity.rival_gain * gain[best]:
        return nearest
    behind = per_group[best] - per_group
    equal = [
        int(k)
        for k in plausible
        if behind[k].mean()
        <= indistinguishable_below(behind[k], float(gain[best]), limits.selection.as_good, limits.ambiguity)
    ]
    equal = [k for k in equal if left[k].scope == left[best].scope and _overlap(left[k], left[best])]
    if left[best].of_bodies:  # a load imitates bodies that are off, but not all of it
        equal = [k for k in equal if gain[k] >= (1 - limits.ambiguity.no_difference) * gain[best]]
    return min(equal, key=lambda k: (left[k].flexibility, -gain[k]), default=best)


def _overlap(one: Hypothesis, other: Hypothesis) -> bool:
    return one.joint == other.joint or None in (one.joint, other.joint)


def _same_place(one: Hypothesis, other: Hypothesis) -> bool:
    """Return whether both are one effect at one place, in any scope or shape."""
    return one.effect == other.effect and (one.joint == other.joint or None in (one.joint, other.joint))


def _variant(trial: Trial, candidates: Sequence[Hypothesis], place: int) -> int:
    before = sum(len(h.variants) for h in candidates[:place])
    return int(trial.best[place]) - before


def _find(trial: Trial, left: Sequence[Hypothesis], place: int, gain: np.ndarray, t: np.ndarray, p: np.ndarray) -> Find:
    variant = left[place].variants[_variant(trial, left, place)]
    return Find(left[place], variant, float(gain[place]), float(t[place]), float(p[place]))


def _backward(
    system: System, moments: Sequence[Moments], found: list[Find], least: np.ndarray, limits: Selection
) -> list[Find]:
    """Drop what gains less than `least` (F,) beside the others: the later ones made it idle."""
    while len(found) > 1:
        short = np.array([_alone(system, moments, found, k, limits) for k in range(len(found))]) / least
        worst = int(np.argmin(short))
        if short[worst] >= 1:
            break
        found = [one for k, one in enumerate(found) if k != worst]
        least = np.delete(least, worst)
    return found


def _alone(system: System, moments: Sequence[Moments], found: Sequence[Find], place: int, limits: Selection) -> float:
    rest = _columns([one for k, one in enumerate(found) if k != place])
    one = found[place]
    trial = attempt(system, moments, rest, [[one.variant]])
    return float(_judged(system, trial, [one.hypothesis], limits)[0][0])
