"""The verdict: whether there is a gap, and whether anything explains it.

First what is left of the gap, before anybody asks how sure a cause is; then, of causes with their confidence, the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.document import document
from irtwin.effects.catalogue import catalogue
from irtwin.gap.isolation.apart import Apart, spread
from irtwin.gap.isolation.finding import ChannelFinding, branches
from irtwin.gap.repeats.disturbances import DRIFT, OFFSET, Disturbance
from irtwin.gap.thresholds import Thresholds

NO_GAP, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_gap", "attributed", "ambiguous", "unexplained"
MUCH_IS_LEFT, IMPOSSIBLE_NUMBER, DOES_NOT_REPEAT, UNSURE = (
    "much_is_left", "impossible_number", "does_not_repeat", "unsure",
)  # fmt: skip


def left_open(
    findings: Sequence[ChannelFinding],
    limits: Thresholds,
    *,
    unmatched: bool = False,
    alike: bool = False,
    differing: Sequence[Disturbance] = (),
    explained: Sequence[Disturbance] = (),
) -> str | None:
    """Return why the gap stays unexplained, however sure its causes are; None where it does not.

    `unmatched`: a cause that cannot be true explains the data far better than those that were named instead.
    `alike`: reference runs were logged as the observed ones are, so that what they leave over one another counts.
    `differing`: what differs between repeats, the largest share first; `explained`: those of it that effects explain.
    """
    if unmatched:
        return IMPOSSIBLE_NUMBER
    located = [disturbance for disturbance in differing if not any(disturbance is known for known in explained)]
    located = [
        disturbance for disturbance in located if not any(_of_friction(disturbance, finding) for finding in findings)
    ]
    named = any(branch.closing.matters(limits.matters) for finding in findings for branch in branches(finding))
    nameless = bool(located) and located[0] is differing[0] and not named
    excesses = (_largest(finding, explained, located) for finding in findings)
    before, after, beside = max(excesses, default=(0.0, 0.0, 0.0))
    much = max(limits.criterion.excess, (1 - limits.matters.closed) * before)
    if alike and not named:
        much = min(much, max(_spread(findings, much), limits.matters.floors**2))
        if _turned(findings, limits):
            return MUCH_IS_LEFT
    if after > much and not (nameless and beside <= much):
        return MUCH_IS_LEFT
    return DOES_NOT_REPEAT if nameless else None


def most_left(findings: Sequence[ChannelFinding], limits: Thresholds, *, alike: bool = False) -> tuple[str, int]:
    """Return the channel and the place in it with the largest excess that causes leave, over floor and references.

    `alike` as of `left_open`: where dry friction turns otherwise than in the reference runs, that is the place.
    """
    left = (alike and _turned(findings, limits)) or {
        (finding.name, place): float(_over(finding.apart, finding.floor_within)[1][place])
        for finding in findings
        if finding.floor_within is not None
        for place in range(len(finding.places))
    }
    return max(left, key=lambda place: left[place])


def verdict_of(findings: Sequence[document.Finding]) -> str:
    """Return the verdict on a gap that is not left open.

    It is `unexplained` where no cause that matters is likely, or none that is likely closes more than nothing for sure.
    A cause is likely where it is, or one of the effects that the data cannot tell from it.
    """
    mattering = [finding for finding in findings if finding.matters]
    if not mattering:
        return NO_GAP
    classes = [sure for finding in mattering if _closes_for_sure(finding) for sure in _classes(finding)]
    likely = [sure for sure in classes if sum(sure) >= document.LIKELY]
    if not likely:
        return UNEXPLAINED
    return AMBIGUOUS if any(len(sure) > 1 for sure in likely) else ATTRIBUTED


def _closes_for_sure(finding: document.Finding) -> bool:
    """Return whether a finding closes more than nothing; what differs between repeats is a gap, however little."""
    return finding.share_interval95[0] > 0 or all(catalogue()[member.effect].disturbance for member in finding.members)


def _classes(finding: document.Finding) -> list[list[float]]:
    """Return the confidences of each cause of a finding and of what the data cannot tell from it."""
    classes: dict[str, list[float]] = {}
    for member in finding.members:
        classes.setdefault(member.cause, []).append(member.confidence)
    return list(classes.values())


def _spread(findings: Sequence[ChannelFinding], unknown: float) -> float:
    """Return the largest spread of the reference runs in any channel; `unknown` where some channel cannot tell it."""
    levels = [(finding.apart.plain, finding.floor_within) for finding in findings]
    known = [spread(plain, level, plain.halves[0]) for plain, level in levels if level is not None]
    return max((unknown if value is None else value for value in known), default=unknown)


def _turned(findings: Sequence[ChannelFinding], limits: Thresholds) -> dict[tuple[str, int], float]:
    """Return the channels and places where dry friction turns otherwise than in the reference runs, by how much."""
    return {
        (finding.name, place): float(more)
        for finding in findings
        if finding.floor_within is not None
        for place, more in enumerate(finding.apart.turned(finding.floor_within))
        if more > limits.criterion.excess
    }


def _largest(
    finding: ChannelFinding, explained: Sequence[Disturbance], located: Sequence[Disturbance]
) -> tuple[float, float, float]:
    """Return the largest excess of a channel without causes, of what these leave, and of that less `located`.

    Over the floor, and over what the reference runs show, if there are any. They may lie at different joints. Of what
    does not repeat, `explained` is out of the equations and is counted in the first; `located` is in them.
    """
    if finding.floor_within is None:
        return 0.0, 0.0, 0.0
    level = finding.apart.level(finding.floor_within)
    before, after = _over(finding.apart, finding.floor_within)
    before = before + _excess(explained, finding, level)
    return float(before.max()), float(after.max()), float((after - _excess(located, finding, level)).max())


def _over(apart: Apart, floor: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (g,) the excess over a floor (g,) and reference runs, without causes and with them.

    A mean over all of a joint's rows: those in which dry friction turns have none.
    """
    before, after = (apart.known * ((rms / apart.level(floor)) ** 2 - 1) for rms in apart.left)
    return before, after


def _of_friction(disturbance: Disturbance, finding: ChannelFinding) -> bool:
    """Return whether friction that differs from run to run makes as much at that place: an offset, or a drift."""
    if disturbance.channel != finding.name or disturbance.kind not in (OFFSET, DRIFT):
        return False
    return bool(disturbance.size < finding.steadied.made[finding.places.index(disturbance.joint)])


def _excess(some: Sequence[Disturbance], finding: ChannelFinding, level: np.ndarray) -> np.ndarray:
    """Return (g,) the excess that some of what does not repeat makes in the equations of a channel."""
    squares = np.zeros(len(finding.places))
    for disturbance in some:
        if disturbance.channel == finding.name:
            squares[finding.places.index(disturbance.joint)] += disturbance.size
    return np.asarray(squares / level**2)
