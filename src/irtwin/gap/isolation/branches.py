"""Branches: the causes of one family at joints that overlap, which a diagnosis answers with before it names effects."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irtwin.gap.isolation.cause import Cause
from irtwin.gap.isolation.closing import Closing
from irtwin.gap.isolation.finding import Finding


@dataclass(frozen=True)
class Branch:
    """Causes of one family and scope in one channel, whose joints overlap, and what they close together."""

    family: str
    scope: str
    causes: tuple[Cause, ...]
    closing: Closing


def branches(finding: Finding) -> tuple[Branch, ...]:
    """Return the branches of a channel, that which closes most first; its causes are in that order too."""
    found = [
        Branch(_family(causes[0]), causes[0].scope, _by_size(finding, causes), finding.closing(causes))
        for causes in joined(finding.causes)
    ]
    return tuple(sorted(found, key=lambda one: -one.closing.size))


def joined(causes: Sequence[Cause]) -> list[list[Cause]]:
    """Return causes by family and scope, those with a joint in common together; of the whole robot, all."""
    found: list[list[Cause]] = []
    for cause in causes:
        near = [one for one in found if any(_near(cause, other) for other in one)]
        found = [one for one in found if one not in near]
        found.append([*(other for one in near for other in one), cause])
    return found


def _near(one: Cause, other: Cause) -> bool:
    if (_family(one), one.scope) != (_family(other), other.scope):
        return False
    return bool(set(one.joints) & set(other.joints)) or not (one.joints or other.joints)


def _family(cause: Cause) -> str:
    return cause.variants[0].effect.family


def _by_size(finding: Finding, causes: Sequence[Cause]) -> tuple[Cause, ...]:
    return tuple(sorted(causes, key=lambda one: -finding.closing([one]).size))
