"""A diagnosis in one line, for the terminal: what the page says first."""

from __future__ import annotations

from irtwin.document.document import Document, Finding
from irtwin.report.gap import findings
from irtwin.report.gap.verdict import closes, differing, misses, where
from irtwin.report.wording import listed


def line(diagnosis: Document, against: str | None) -> str:
    """Return the verdict and what the page says of it; `against`: role of the runs compared with, if any."""
    told = [_told(one, against) for one in diagnosis.findings]
    place = next(iter(diagnosis.locations), None)
    closed, tracking = diagnosis.shrink.closed_fraction, diagnosis.shrink.position_rmse
    sentence = findings.sentence(
        diagnosis.verdict,
        told,
        "" if place is None else where(place.channel, place.joint, place.regime and _words(place.regime), place.share),
        None if closed is None else closes(closed.value, closed.interval95, tracking is not None),
        diagnosis.unexplained_because,
        differing(
            [(one.kind, one.channel, one.joint) for one in diagnosis.not_repeating or () if not one.explained_by]
        ),
        diagnosis.shrink.noise_floor_from is not None,
        against,
        None if tracking is None else misses(tracking.before),
    )
    numbers = findings.other_numbers([
        (one.name, one.joint, one.simulator, one.robot, one.unit)
        for cause in diagnosis.mattering
        for one in cause.parameters
        if cause.likely and one.simulator is not None and one.robot is not None
    ])  # fmt: skip
    look = findings.look_at(diagnosis.verdict, diagnosis.odd_stretches or ())
    return f"{diagnosis.verdict}: {sentence}{numbers}{look}".replace("\N{NO-BREAK SPACE}", " ")


def _told(one: Finding, against: str | None) -> findings.ToldFinding:
    members = [[member for member in one.members if member.cause == cause] for cause in one.causes]
    return findings.ToldFinding(
        family=one.family,
        joints=one.joints,
        against="twin" if one.scope == "missing" else against or "reference",
        channel=one.channel,
        confidence=one.confidence,
        share=one.share,
        interval=one.share_interval95,
        of=one.share_of,
        matters=one.matters,
        members=tuple(tuple((_words(each.effect), each.confidence) for each in some) for some in members),
    )


def _words(name: str) -> str:
    return name.replace("_", " ")


def refused(diagnosis: Document) -> list[str]:
    """Return a line for each effect that was refused as a cause."""
    return [
        f"refused: {_words(one.effect)}{f' on {listed(one.joints)}' if one.joints else ''}: {one.why}"
        for one in diagnosis.refused or ()
    ]
