"""A diagnosis in words, for terminal and page alike: findings by family, the largest first, at most a handful."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from irtwin.report import wording

_NAMED = 3  # findings that a sentence names; the rest are counted
_LIKELY = 0.5  # confidence: below it a finding is a guess

Alternative = tuple[str, float]  # what an effect is called, and its confidence


@dataclass(frozen=True)
class Finding:
    """A finding as it is told: `members`, for each of its causes, the cause and what the data cannot tell from it.

    against: what it is held against: "twin", "reference" or "simulated" runs, or "both" of these. share, interval: of
    its channel's gap that closes, `of` what it is a share.
    """

    family: str
    joints: tuple[str, ...]
    against: str
    channel: str
    confidence: float
    share: float
    interval: tuple[float, float]
    of: str
    matters: bool
    members: tuple[tuple[Alternative, ...], ...]

    @property
    def place(self) -> str:
        """Family and joints: "friction of joint_2"."""
        return f"{self.family} of {wording.listed(self.joints)}" if self.joints else self.family

    @property
    def claim(self) -> str:
        """What is said of the family."""
        return f"{self.place} {_CLAIMS[self.against]}"

    @property
    def effects(self) -> str:
        """The causes with their confidences, each with its alternatives."""
        return " and ".join(" or ".join(_sure(*one) for one in some) for some in self.members)

    @property
    def sentence(self) -> str:
        """The whole finding; a guess without its effects."""
        if self.confidence < _LIKELY:
            return f"perhaps {self.place} ({wording.share(self.confidence)})"
        known = [sure for some in self.members for _, sure in some] == [self.confidence]
        sure = "" if known else f" ({wording.share(self.confidence)})"
        return f"{self.claim}{sure}: {self.effects}"


_CLAIMS = {
    "twin": "differs from the twin’s",
    "reference": "changed since the reference runs",
    "simulated": "differs from the simulator’s",
    "both": "changed since the reference runs, and differs from the simulator’s",
}


def sentence(verdict: str, findings: Sequence[Finding], where: str, closes: str | None) -> str:
    """Return the verdict in plain words; `where` the gap lies may be empty.

    closes: how much of it is closed; None: unknown of the whole, and said of the first finding.
    """
    if verdict == "no_gap":
        if not findings:
            return "There is no gap: the twin explains the data down to the noise floor."
        return f"There is no gap that matters: {counted(findings)}."
    told = [one for one in findings if one.matters][:_NAMED]
    rest = [one for one in findings if one not in told]
    said = "; ".join(one.sentence for one in told)
    if told and all(one.confidence < _LIKELY for one in told):
        said = f"nothing that was found is sure: {said}"
    beside = f" Not named here: {counted(rest)}." if rest else ""
    if verdict == "unexplained":
        part = f" Part of it is closed: {said}." if said else ""
        return f"There is a gap{where}, and no effect in the catalogue closes it.{part}{beside}"
    if closes is None:
        closes = "".join(_closes(one, len(told)) for one in told[:1])
    return f"{said[:1].upper()}{said[1:]}.{closes}{beside}"


def _closes(one: Finding, count: int) -> str:
    """Say what the first of so many findings closes by itself."""
    what = "That" if count == 1 else "The first of these"
    ends = " to ".join(map(wording.share, one.interval))
    of = "gap in" if one.of.startswith("the gap") else "mean square of"
    return (
        f" {what} closes {wording.part(one.share)} of the {of} {one.channel} on held-out runs (95 % interval {ends})."
    )


def folded(count: int, channel: str, share: float) -> str:
    """Say how many findings there are that are not told by themselves, and what they close together."""
    closed = wording.part(share) if share > 0 else "nothing"
    found = "1 finding closes" if count == 1 else f"{count} findings together close"
    return f"{found} {closed} of the gap in {channel}"


def counted(findings: Sequence[Finding]) -> str:
    """Count findings, by channel, with what they close together; empty where there are none."""
    of_channel: dict[str, list[float]] = {}
    for one in findings:
        of_channel.setdefault(one.channel, []).append(one.share)
    return wording.listed([folded(len(shares), channel, sum(shares)) for channel, shares in of_channel.items()])


def _sure(name: str, confidence: float) -> str:
    return f"{name} ({wording.share(confidence)})"
