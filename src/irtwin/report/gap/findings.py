"""A diagnosis in words, for terminal and page alike: findings by family, the largest first, at most a handful."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from irtwin.document.document import LIKELY
from irtwin.document.odd_stretch import OddStretch, odd
from irtwin.effects.catalogue import catalogue
from irtwin.report import wording

_NAMED = 3  # findings that a sentence names; the rest are counted
_PARTS_OF_LINKS = ("centre_", "inertia_")  # a link is told by its mass
_SPELT_OUT = 4  # joints of one of them; of more it says how many

Alternative = tuple[str, float]  # what an effect is called, and its confidence
OtherNumber = tuple[str, str | None, float, float, str, Sequence[float] | None]
"""A number of a simulator's model that the robot has otherwise: name, joint, the model's, the robot's, unit, interval.

The interval is of the change; None where it has none.
"""


@dataclass(frozen=True)
class ToldFinding:
    """A finding as it is told: `members`, for each of its causes, the cause and what the data cannot tell from it.

    against: what it is held against: "twin", "reference" or "simulated" runs. share, interval: of its channel's gap
    that closes, `of` what it is a share.
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
        """Family and joints: "friction of joint_2"; of many joints how many, which tables beside it name."""
        joints = wording.listed(self.joints) if len(self.joints) <= _SPELT_OUT else f"{len(self.joints)} joints"
        return f"{self.family} of {joints}" if self.joints else self.family

    @property
    def claim(self) -> str:
        """What is said of the family; of a guess, no more than that it is one."""
        if not self.likely:
            return f"perhaps {self.place}"
        claim = _CLAIMS[self.against]
        return f"{self.place} {claim.replace('differs', 'differ') if self.family == 'bodies' else claim}"

    @property
    def likely(self) -> bool:
        """Whether it is more likely than not, and no guess."""
        return self.confidence >= LIKELY

    @property
    def has_alternatives(self) -> bool:
        """Whether the data do not tell one of its causes from other effects."""
        return any(len(some) > 1 for some in self.members)

    @property
    def effects(self) -> str:
        """The causes, each with its alternatives; of those beside likely ones the number.

        Confidences stand beside them, unless all are as sure as the finding.
        """
        told = [some for some in self.members if _together(some) >= LIKELY] or self.members
        guesses = len(self.members) - len(told)
        beside = f", and {guesses} less likely" if guesses else ""
        as_sure = all(wording.share(chance) == wording.share(self.confidence) for some in told for _, chance in some)
        names = [" or ".join(name if as_sure else _with(name, chance) for name, chance in some) for some in told]
        return wording.listed(list(dict.fromkeys(names))) + beside

    @property
    def sentence(self) -> str:
        """The whole finding; a guess without its effects, unless one of them is likely."""
        sure = f"({wording.share(self.confidence)} sure)"
        if not self.likely:
            one_of = any(_together(some) >= LIKELY for some in self.members)
            return f"{self.claim} {sure}" + (f": {self.effects}" if one_of else "")
        if [chance for some in self.members for _, chance in some] == [self.confidence]:
            return f"{self.claim}: {self.members[0][0][0]} {sure}"
        return f"{self.claim} {sure}: {self.effects}"


_CLAIMS = {
    "twin": "differs from the twin’s",
    "reference": "changed since the reference runs",
    "simulated": "differs from the simulator’s",
}


NOT_REPEATING = {
    "line": "an oscillation",
    "band": "a band of oscillations",
    "switching": "a load that switches",
    "drift": "a drift",
    "offset": "an offset",
}
"""What runs of one motion differ by, in words."""


def sentence(
    verdict: str,
    findings: Sequence[ToldFinding],
    where: str,
    closes: str | None,
    because: str | None = None,
    differ: str = "",
    has_floor: bool = True,
    agrees: str | None = None,
    left: str | None = None,
) -> str:
    """Return the verdict in plain words; `where` the gap lies may be empty.

    closes: how much of it is closed; None: unknown of the whole, and said of the first finding. `because`: of the
    verdict `unexplained`, as in the document; `differ`: by what runs of one motion differ, of what nothing explains;
    `has_floor`: whether a noise floor is known; `agrees`: how far a simulator does, where it is held against one;
    `left`: what is said where the twin leaves far more than noise, and no gap.
    """
    if verdict == "no_gap":
        if agrees is not None:
            beside = f" Beyond this, {counted(findings)}." if findings else ""
            return f"There is no gap: the simulator agrees with the robot, {agrees}.{beside}"
        if not findings and not has_floor:
            return (
                "No cause of a gap was found. The noise of these data is not known: the twin may leave more than noise."
            )
        if not findings:
            return left or "There is no gap: away from reversals the twin explains the data down to the noise floor."
        return f"There is no gap that matters: {counted(findings)}."
    told = _told(findings)
    rest = [finding for finding in findings if finding not in told]
    words, guessed = "; ".join(finding.sentence for finding in told), not any(finding.likely for finding in told)
    beside = f" Beyond this, {counted(rest)}." if rest else ""
    if verdict == "unexplained" and because != "unsure":
        part = "" if not told else f" Part of it is {words}." if guessed else f" Part of it is closed: {words}."
        return f"{_left(because, where, differ)}{part}{beside}"
    if verdict == "unexplained":
        words = f"there is a gap{where}{', and no cause that was found is sure' if guessed else ''}: {words}"
    elif guessed:
        words = f"several effects explain the gap{where}, and none of them is sure: {words}"
    if closes is None:
        closes = "".join(_closes(finding, len(told)) for finding in told[:1])
    differing = f" Besides, runs of one motion differ by {differ}, which no effect explains." if differ else ""
    unsure = " How much of the gap that makes is not sure." if verdict == "unexplained" and not guessed else ""
    return f"{words[:1].upper()}{words[1:]}.{unsure}{closes}{differing}{beside}"


def _told(findings: Sequence[ToldFinding]) -> list[ToldFinding]:
    """Return the findings that are named, in their order: of those that matter the likely ones, then guesses."""
    mattering = (finding for finding in findings if finding.matters)
    those = sorted(mattering, key=lambda finding: not finding.likely)[:_NAMED]
    return [finding for finding in findings if finding in those]


def _left(because: str | None, where: str, differ: str) -> str:
    """Say why a gap is unexplained, however sure its causes are."""
    if because == "does_not_repeat":
        return f"Runs of one motion differ by {differ}, and no effect in the catalogue explains that."
    if because == "impossible_number":
        return f"There is a gap{where}, and what would close it needs a number that cannot be true."
    return f"There is a gap{where}, and no effect in the catalogue closes it."


def _closes(finding: ToldFinding, count: int) -> str:
    """Say what the first of so many findings closes by itself."""
    subject = "That" if count == 1 else "The first of these"
    of = "gap in" if finding.of.startswith("the gap") else "mean square of"
    share = f"{wording.part(finding.share)} of the {of} {finding.channel} on held-out runs"
    return f" {subject} closes {share} {within(finding.interval)}."


def other_numbers(differing: Sequence[OtherNumber]) -> str:
    """Say which numbers of the simulator's model the robot has otherwise for sure, the farthest first; may be empty.

    It comes before what the verdict says: who has a model looks for its numbers.

    What a model's file has another word for has this word, with the symbol that tables have.
    """
    words = {name: f"{word} ({name})" for effect in catalogue().values() for name, word in effect.in_mjcf.items()}

    def apart(number: OtherNumber) -> float:
        _, _, model, robot, *_ = number
        return abs(math.log(robot / model)) if robot / (model or math.inf) > 0 else math.inf

    whole = [number for number in differing if not number[0].startswith(_PARTS_OF_LINKS)]
    sure = [number for number in whole if not number[-1] or not number[-1][0] <= 0 <= number[-1][1]]
    told = [
        f"{words.get(name, name)}{f' of {joint}' if joint else ''} "
        f"{wording.quantity(robot, '' if unit == '1' else unit).rstrip()} in place of {wording.number(model)}"
        for name, joint, model, robot, unit, _ in sorted(sure, key=apart, reverse=True)[:_NAMED]
    ]
    rest = len(sure) - len(told)
    more = f", and {rest} more" if rest else ""
    return f"The robot has other numbers than the simulator: {', '.join(told)}{more}. " if told else ""


def look_at(verdict: str, stretches: Sequence[OddStretch]) -> str:
    """Say which stretches of runs stand out in a gap that is unexplained; may be empty."""
    if verdict != "unexplained" or not stretches:
        return ""
    return f" Look first at {odd(stretches)}: there the twin leaves over six times as much torque as elsewhere."


def within(interval: Sequence[float]) -> str:
    """Say the interval of a share."""
    return f"(95 % interval {' to '.join(map(wording.share, interval))})"


def counted(findings: Sequence[ToldFinding]) -> str:
    """Count findings, by channel, with what they close together; empty where there are none."""
    of_channel: dict[str, list[float]] = {}
    for finding in findings:
        of_channel.setdefault(finding.channel, []).append(finding.share)
    said = []
    for channel, shares in of_channel.items():
        closed = wording.part(sum(shares)) if sum(shares) > 0 else "nothing"
        words = "1 finding closes" if len(shares) == 1 else f"{len(shares)} findings together close"
        said.append(f"{words} {closed} of the gap in {channel}")
    return wording.listed(said)


def _together(alternatives: Sequence[Alternative]) -> float:
    return sum(chance for _, chance in alternatives)


def _with(name: str, confidence: float) -> str:
    return f"{name} ({wording.share(confidence)})"
