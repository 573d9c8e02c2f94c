"""Which effects explain the gap: forward selection on groups left out, rivals, and what each cause closes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from irtwin.effects.effect import BASELINE
from irtwin.gap.episodes import brief, in_scope
from irtwin.gap.hypotheses import MISSING, Hypothesis, Variant
from irtwin.gap.significance import p_values
from irtwin.gap.system import System, Trial, attempt, scores

_ROUNDS = 12
_MATTERS = 0.08  # of the mean square of one equation's residual: less than this a cause has to explain
_LEAST_SHARE = 0.01  # of what the largest cause explains
_ALPHA = 0.02  # of the whole catalogue
_LEAST_T = 2.3  # mean gain over its standard error between groups
_NEAR = 0.9  # of the best gain at a joint: the effect that leads elsewhere is taken there too
_RIVAL = 0.8  # of the cause's gain a rival explains
_APART = 2.0  # standard errors between groups that tell rivals apart
_PLAIN = 0.5  # of the best gain: a form of the default twin that is missing goes before what refines it
_SAME = 0.01  # of the gain: a smaller difference is none
_AT_MOST = 0.05  # of the gain: a larger difference is one, whatever its error


@dataclass(frozen=True)
class Cause:
    """An effect in one or more joints (the variants chosen), with what it explains on groups left out.

    gain: (G,) of weighted squares; p: adjusted for the whole catalogue; t: of the gain, between groups; `rivals`: the
    effects that explain it as well; `columns`: the indices of its columns.
    """

    effect: str
    scope: str
    joints: tuple[str, ...]
    variants: tuple[Variant, ...]
    gain: float
    t: float
    p: float
    rivals: tuple[str, ...] = ()
    rival_gains: dict[str, float] = field(default_factory=dict)

    @property
    def columns(self) -> tuple[int, ...]:
        """The indices of its columns."""
        return tuple(k for variant in self.variants for k in variant.columns)


@dataclass(frozen=True)
class Attribution:
    """The causes found, ranked by gain; `noise` (g,) what they leave; `visible` of each hypothesis before any."""

    causes: tuple[Cause, ...]
    noise: np.ndarray
    hypotheses: tuple[Hypothesis, ...]
    visible: np.ndarray
    share_visible: np.ndarray


@dataclass(frozen=True)
class _Found:
    hypothesis: Hypothesis
    variant: Variant
    gain: float
    t: float
    p: float


def attribute(system: System, candidates: Sequence[Hypothesis], seed: int) -> Attribution:
    """Find the effects that the data show beyond the twin's.

    Each round tries every hypothesis beside those chosen, refits everything, and judges it on groups left out; an
    episode by what its joints say of each other.
    """
    candidates = in_scope(candidates, both=system.both)
    noise = np.maximum(system.residual_rms((), np.ones(len(system.pattern))), 1e-9)
    noise = np.maximum(system.residual_rms((), noise), 1e-9)
    moments = system.moments(noise)
    first = attempt(system, moments, (), [h.variants for h in candidates])
    found: list[_Found] = []
    for _ in range(_ROUNDS):
        chosen = _columns(found)
        new = _round(system, moments, noise, candidates, chosen, found, seed)
        if not new:
            break
        found.extend(new)
        noise = np.maximum(system.residual_rms(_columns(found), noise), 1e-9)
        moments = system.moments(noise)
    found = _backward(system, moments, found)
    causes = _causes(system, moments, candidates, found)
    noise = np.maximum(system.residual_rms([k for cause in causes for k in cause.columns], noise), 1e-9)
    return Attribution(causes, noise, tuple(candidates), first.visible, first.share_visible)


def _columns(found: Sequence[_Found]) -> list[int]:
    return [k for one in found for k in one.variant.columns]


def _gains(system: System, trial: Trial, candidates: Sequence[Hypothesis]) -> tuple[np.ndarray, np.ndarray]:
    """Return each hypothesis' gain per row and its t between groups, (H,): of the gain, or of its share in each group.

    A group in which little happens has little to gain, which speaks not against an effect.
    """
    rows = np.maximum(system.rows.max(axis=1), 1.0)
    gain = (trial.start - trial.loss) / rows  # (H, G)
    mean, t = np.empty(len(candidates)), np.empty(len(candidates))
    for k, hypothesis in enumerate(candidates):
        own = system.group_observed if hypothesis.scope == "changed" else np.ones(len(rows), dtype=bool)
        mean[k] = np.average(gain[k, own], weights=rows[own])
        share = gain[k, own] * rows[own] / np.maximum(trial.start[own], 1e-12)
        t[k] = max(_t(gain[k, own]), _t(share))
    return mean, t


def _t(values: np.ndarray) -> float:
    """Return the mean over its standard error; none of one value."""
    if len(values) < 2:
        return 0.0
    return float(values.mean() / max(values.std(ddof=1) / np.sqrt(len(values)), 1e-12))


def _round(
    system: System,
    moments: Sequence[np.ndarray],
    noise: np.ndarray,
    candidates: Sequence[Hypothesis],
    chosen: Sequence[int],
    found: Sequence[_Found],
    seed: int,
) -> list[_Found]:
    taken = set(chosen)
    left = [h for h in candidates if not any(set(v.columns) & taken for v in h.variants)]
    left = [h for h in left if not any(_same_place(h, one.hypothesis) for one in found)]
    if not left:
        return []
    trial = attempt(system, moments, chosen, [h.variants for h in left])
    gain, t = _gains(system, trial, left)
    episodes = [k for k, one in enumerate(left) if system.episode and any(brief(v.effect) for v in one.variants)]
    t[episodes] = system.episode.t if system.episode else 0.0
    plausible = np.flatnonzero((gain >= _MATTERS) & (t >= _LEAST_T))
    if not len(plausible):
        return []
    block_scores, products = scores(system, moments, noise, chosen)
    p = p_values(block_scores, products, left, seed)
    p[episodes] = system.episode.p if system.episode else 1.0
    bodies = np.array([left[k].effect == "rigid_body" for k in plausible])  # too many for a score by column
    plausible = plausible[(p[plausible] <= _ALPHA) | bodies]
    if not len(plausible):
        return []
    best = _leader(plausible, gain, _per_row(system, trial), left, found)
    leader = left[best]
    taken_now = [int(best)]
    if leader.joint is not None:
        for k in plausible:
            other = left[k]
            if k == best or other.effect != leader.effect or other.scope != leader.scope or other.joint is None:
                continue
            rivals = [gain[j] for j in plausible if left[j].joint == other.joint]
            robot = [gain[j] for j in plausible if left[j].joint is None]
            near = _PLAIN if other.effect in BASELINE and other.scope == MISSING else _NEAR
            if gain[k] >= near * max(rivals) and (not robot or max(robot) < gain[best]):
                taken_now.append(int(k))
    return [
        _Found(left[k], left[k].variants[_variant(trial, left, k)], float(gain[k]), float(t[k]), float(p[k]))
        for k in taken_now
    ]


def _per_row(system: System, trial: Trial) -> np.ndarray:
    """Return each hypothesis' gain per row in each group, (H, G)."""
    return np.asarray((trial.start - trial.loss) / np.maximum(system.rows.max(axis=1), 1.0))


def _leader(
    plausible: np.ndarray,
    gain: np.ndarray,
    per_group: np.ndarray,
    left: Sequence[Hypothesis],
    found: Sequence[_Found],
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
        and gain[k] >= _PLAIN * gain[best]
    ]
    if plain:
        return max(plain, key=lambda k: gain[k])
    before = {(one.hypothesis.effect, one.hypothesis.scope) for one in found}
    known = [int(k) for k in plausible if (left[k].effect, left[k].scope) in before and left[k].joint]
    if known and (nearest := max(known, key=lambda k: gain[k])) != best and gain[nearest] >= _RIVAL * gain[best]:
        return nearest
    equal = [int(k) for k in plausible if _equals(per_group[best] - per_group[k], gain[best])]
    equal = [k for k in equal if left[k].scope == left[best].scope and _overlap(left[k], left[best])]
    if left[best].effect == "rigid_body":  # a load imitates bodies that are off, but not all of it
        equal = [k for k in equal if gain[k] >= (1 - _SAME) * gain[best]]
    return min(equal, key=lambda k: (left[k].flexibility, -gain[k]), default=best)


def _equals(behind: np.ndarray, gain: float) -> bool:
    """Return whether a hypothesis is behind the best (whose gain is given) by no more than chance, over groups."""
    error = float(behind.std(ddof=1)) / np.sqrt(len(behind)) if len(behind) > 1 else 0.0
    return float(behind.mean()) <= max(_SAME * gain, min(_APART * error, _AT_MOST * gain))


def _overlap(one: Hypothesis, other: Hypothesis) -> bool:
    return one.joint == other.joint or None in (one.joint, other.joint)


def _same_place(one: Hypothesis, other: Hypothesis) -> bool:
    """Return whether both are one effect at one place, in any scope or shape."""
    return one.effect == other.effect and (one.joint == other.joint or None in (one.joint, other.joint))


def _variant(trial: Trial, candidates: Sequence[Hypothesis], place: int) -> int:
    before = sum(len(h.variants) for h in candidates[:place])
    return int(trial.best[place]) - before


def _backward(system: System, moments: Sequence[np.ndarray], found: list[_Found]) -> list[_Found]:
    """Drop what the later ones made idle."""
    while len(found) > 1:
        gains = [_alone(system, moments, found, k) for k in range(len(found))]
        worst = int(np.argmin(gains))
        if gains[worst] >= _MATTERS / 2:
            break
        found = [one for k, one in enumerate(found) if k != worst]
    return found


def _alone(system: System, moments: Sequence[np.ndarray], found: Sequence[_Found], place: int) -> float:
    rest = _columns([one for k, one in enumerate(found) if k != place])
    one = found[place]
    trial = attempt(system, moments, rest, [[one.variant]])
    return float(_gains(system, trial, [one.hypothesis])[0][0])


def _causes(
    system: System, moments: Sequence[np.ndarray], candidates: Sequence[Hypothesis], found: Sequence[_Found]
) -> tuple[Cause, ...]:
    """Join the finds of one effect and scope into causes, and look for rivals of each."""
    keys = list(dict.fromkeys((one.hypothesis.effect, one.hypothesis.scope) for one in found))
    causes: list[Cause] = []
    for effect, scope in keys:
        members = [one for one in found if (one.hypothesis.effect, one.hypothesis.scope) == (effect, scope)]
        others = _columns([one for one in found if one not in members])
        causes.append(_with_rivals(system, moments, candidates, members, others))
    most = max((cause.gain for cause in causes), default=0.0)
    matter = [cause for cause in causes if cause.gain >= _LEAST_SHARE * most]
    return tuple(sorted(matter, key=lambda cause: -cause.gain))


def _with_rivals(
    system: System,
    moments: Sequence[np.ndarray],
    candidates: Sequence[Hypothesis],
    members: Sequence[_Found],
    others: Sequence[int],
) -> Cause:
    joints = tuple(one.hypothesis.joint for one in members if one.hypothesis.joint)
    effect, scope = members[0].hypothesis.effect, members[0].hypothesis.scope
    free = [h for h in candidates if not any(set(v.columns) & set(others) for v in h.variants)]
    single = attempt(system, moments, others, [h.variants for h in free])
    choice = {(h.effect, h.scope, h.joint): h.variants[_variant(single, free, k)] for k, h in enumerate(free)}
    rivals: list[tuple[str, str, tuple[Variant, ...]]] = [(effect, scope, tuple(one.variant for one in members))]
    for name, other_scope in dict.fromkeys((h.effect, h.scope) for h in free):
        if (name, other_scope) == (effect, scope):
            continue
        for places in dict.fromkeys([joints, (None,)]):
            parts = [choice.get((name, other_scope, joint)) for joint in places]
            if parts and all(part is not None for part in parts):
                rivals.append((name, other_scope, tuple(part for part in parts if part is not None)))
    joined = [[_joined(parts)] for _, _, parts in rivals]
    trial = attempt(system, moments, others, joined)
    rows = np.maximum(system.rows.max(axis=1), 1.0)
    own = system.group_observed if scope == "changed" else np.ones(len(rows), dtype=bool)
    per_group = ((trial.start - trial.loss) / rows)[:, own]
    gain = np.average(per_group, axis=1, weights=rows[own])
    equal: list[str] = []
    for k, (name, _, _) in enumerate(rivals[1:], start=1):
        apart = per_group[0] - per_group[k]
        error = float(np.std(apart, ddof=1)) / np.sqrt(len(apart))
        near = gain[0] - gain[k] < max(_SAME * gain[0], min(_APART * error, (1 - _RIVAL) * gain[0]))
        if name != effect and near:
            equal.append(name)
    known: dict[str, float] = {}
    for k, (name, _, _) in enumerate(rivals):
        if name != effect:
            known[name] = max(known.get(name, -np.inf), float(gain[k]))
    return Cause(
        effect=effect,
        scope=scope,
        joints=joints,
        variants=tuple(one.variant for one in members),
        gain=float(gain[0]),
        t=_own_t(members) or max(_t(per_group[0]), _t(per_group[0] * rows[own] / np.maximum(trial.start[own], 1e-12))),
        p=max(one.p for one in members),
        rivals=tuple(dict.fromkeys(sorted(equal, key=lambda name: -known[name]))),
        rival_gains=known,
    )


def _own_t(members: Sequence[_Found]) -> float | None:
    """Return an episode's t, which is between joints."""
    return members[0].t if brief(members[0].variant.effect) else None


def _joined(parts: Sequence[Variant]) -> Variant:
    columns = tuple(k for part in parts for k in part.columns)
    return Variant(parts[0].effect, columns, tuple(term for part in parts for term in part.terms))
