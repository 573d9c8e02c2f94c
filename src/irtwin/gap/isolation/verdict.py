"""The verdict: whether there is a gap, and whether anything explains it.

First what is left of the gap, before anybody asks how sure a cause is; then, of causes with their confidence, the rest.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from irtwin.document import document
from irtwin.effects.catalogue import catalogue
from irtwin.gap.isolation.apart import spread
from irtwin.gap.isolation.finding import ChannelFinding, branches
from irtwin.gap.repeats.disturbances import DRIFT, OFFSET, Disturbance
from irtwin.gap.thresholds import Thresholds

NO_GAP, ATTRIBUTED, AMBIGUOUS, UNEXPLAINED = "no_gap", "attributed", "ambiguous", "unexplained"
MUCH_IS_LEFT, IMPOSSIBLE_NUMBER, DOES_NOT_REPEAT, UNSURE = (
    "much_is_left", "impossible_number", "does_not_repeat", "unsure",
)  # fmt: skip

Place = tuple[str, int]
"""A channel, and the number of a place in it."""


def left_open(
    findings: Sequence[ChannelFinding],
    limits: Thresholds,
    *,
    unmatched: bool = False,
    alike: bool = False,
    between: bool = False,
    differing: Sequence[Disturbance] = (),
    explained: Sequence[Disturbance] = (),
) -> tuple[str | None, Place | None]:
    """Return why the gap stays unexplained, however sure its causes are, and where much is left; None if it does not.

    `unmatched`: a cause that cannot be true explains the data far better than those that were named instead.
    `alike`: reference runs were logged as the observed ones are, so that what they leave over one another counts.
    `between`: a gap is what lies between the sides, as a simulator's runs leave what the twin lacks, too.
    `differing`: what differs between repeats, the largest share first; `explained`: those of it that effects explain.
    """
    if unmatched:
        return IMPOSSIBLE_NUMBER, None
    located = [disturbance for disturbance in differing if not any(disturbance is known for known in explained)]
    located = [
        disturbance for disturbance in located if not any(_of_friction(disturbance, finding) for finding in findings)
    ]
    named = any(branch.closing.matters(limits.matters) for finding in findings for branch in branches(finding))
    nameless = bool(located) and located[0] is differing[0] and not named

    def beyond(*, references: bool, most: float | None = None) -> Place | None:
        """Return where most is left over the floor or the other runs, if it is much, or more than `most`."""
        excesses = (_largest(finding, explained, located, references) for finding in findings)
        before, after, beside = max(excesses, default=(0.0, 0.0, 0.0))
        much = max(limits.criterion.excess, (1 - limits.matters.closed) * before)
        much = much if most is None else min(much, most)
        return _most_left(findings, references) if after > much and not (nameless and beside <= much) else None

    place = beyond(references=True)
    if place is None and not named and not between:
        place = beyond(references=False)  # what the twin lacks in the other runs, too
    if alike and not named:
        known = _spread(findings)
        most = None if known is None else max(known, limits.matters.floors**2)
        place = _turned(findings, limits) or place or beyond(references=True, most=most)
    if place is not None:
        return MUCH_IS_LEFT, place
    return (DOES_NOT_REPEAT, None) if nameless else (None, None)


def _most_left(findings: Sequence[ChannelFinding], references: bool) -> Place:
    """Return the channel and the place in it with the largest excess that causes leave."""
    left = {
        (finding.name, place): float(excess)
        for finding in findings
        if finding.floor_within is not None
        for place, excess in enumerate(_over(finding, references)[1])
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


def _spread(findings: Sequence[ChannelFinding]) -> float | None:
    """Return the largest spread of the reference runs in any channel; None where some channel cannot tell it."""
    levels = [(finding.apart.plain, finding.floor_within) for finding in findings]
    known = [spread(plain, level, plain.halves[0]) for plain, level in levels if level is not None]
    return None if None in known else max((value for value in known if value is not None), default=None)


def _turned(findings: Sequence[ChannelFinding], limits: Thresholds) -> Place | None:
    """Return where dry friction turns otherwise than in the reference runs, by most; None where it does not."""
    turned = {
        (finding.name, place): float(more)
        for finding in findings
        if finding.floor_within is not None
        for place, more in enumerate(finding.apart.turned(finding.floor_within))
        if more > limits.criterion.excess
    }
    return max(turned, key=lambda place: turned[place], default=None)


def _largest(
    finding: ChannelFinding, explained: Sequence[Disturbance], located: Sequence[Disturbance], references: bool
) -> tuple[float, float, float]:
    """Return the largest excess of a channel without causes, of what these leave, and of that less `located`.

    They may lie at different joints. Of what does not repeat, `explained` is out of the equations and is counted in the
    first; `located` is in them.
    """
    if finding.floor_within is None:
        return 0.0, 0.0, 0.0
    level = _level(finding, references)
    before, after = _over(finding, references)
    before = before + _excess(explained, finding, level)
    return float(before.max()), float(after.max()), float((after - _excess(located, finding, level)).max())


def _over(finding: ChannelFinding, references: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return (g,) the excess, without causes and with them.

    A mean over all of a joint's rows: those in which dry friction turns have none.
    """
    apart, level = finding.apart, _level(finding, references)
    before, after = (apart.known * ((rms / level) ** 2 - 1) for rms in apart.left)
    return before, after


def _level(finding: ChannelFinding, references: bool) -> np.ndarray:
    """Return (g,) RMS beyond which there is an excess: the floor, or what the other runs leave, if that is more."""
    assert finding.floor_within is not None
    return finding.apart.level(finding.floor_within) if references else finding.floor_within


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
