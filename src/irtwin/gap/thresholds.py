"""The thresholds of a diagnosis: every value by which it decides what is said, with its meaning, unit and origin.

A group for each step. `diagnose` takes them whole, and each step its own group; `changed` makes a variant, as
`bench/blind/sweep.py` does. What only sets the effort or precision of an algorithm stands beside that algorithm.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from irtwin.errors import InputError


def _threshold(value: Any, meaning: str, unit: str, source: str) -> Any:
    return field(default=value, metadata={"meaning": meaning, "unit": unit, "source": source})


_P = "probability"


@dataclass(frozen=True)
class Data:
    """What runs of one robot, logged well, may differ by."""

    shortest: float = _threshold(1.0, "observed runs last so long together", "s", "judgement")
    little: float = _threshold(
        0.1,
        "of a joint: slow beside its largest speed, steady beside its largest acceleration, a repeat beside its spread",
        "share",
        "judgement",
    )
    smoothed: float = _threshold(
        5.0,
        "a spectrum that falls faster up to half the sampling rate was smoothed: it tells no noise",
        "power of the frequency",
        "decisions/gap-regression.md",
    )
    moved: float = _threshold(
        0.2,
        "a number of a twin that is given may have moved so far since, one standard deviation",
        "share of the number and half of the catalogue's spread",
        "decisions/simulator.md",
    )
    foreign: Mapping[str, float] = field(
        default_factory=lambda: {"reference": 0.03, "simulated": 0.15},
        metadata={
            "meaning": "bodies fitted to the other runs leave more in joints of another robot, by the runs' role",
            "unit": "share of the joint's mean square",
            "source": "decisions/gap-criterion.md",
        },
    )


@dataclass(frozen=True)
class Criterion:
    """How likely a structure of effects is: see `docs/how-it-decides.md`."""

    misfit: float = _threshold(
        0.05, "what no effect names, along any effect", "share of the RMS that is left", "decisions/gap-criterion.md"
    )
    misfit_unexplained: float = _threshold(
        0.2, "the same of what is left above the floor", "share of its RMS", "decisions/gap-criterion.md"
    )
    excess: float = _threshold(
        3.5,
        "what is left beyond is no noise, whatever the floor missed, and a gap without a cause",
        "floor squared",
        "decisions/gap-verdict.md",
    )
    certainty: float = _threshold(
        12.0, "how well that share is known", "looks at other robots, effectively", "decisions/gap-criterion.md"
    )
    unknown: float = _threshold(
        0.08,
        "an effect that the catalogue lacks looks like the cause; one as likely as that is named as a rival",
        _P,
        "decisions/gap-criterion.md",
    )
    unknown_there: float = _threshold(
        0.5, "the same where much of the gap is left, so that such an effect is there", _P, "decisions/gap-criterion.md"
    )

    def visible(self, hypotheses: int) -> float:
        """Return the mean square, in units of the noise, from which so many hypotheses let an effect be likely."""
        against = hypotheses ** (2 / (self.certainty + 1)) - 1
        return float(self.certainty * self.misfit**2 * against)


@dataclass(frozen=True)
class Matters:
    """What is worth a word to a person."""

    share: float = _threshold(
        0.02, "least that a cause closes", "share of its channel's gap", "decisions/gap-verdict.md"
    )
    floors: float = _threshold(
        0.5,
        "least that is more than noise, RMS: what a cause closes, what differs between repeats, a gap, a run",
        "floors",
        "decisions/gap-verdict.md",
    )
    closed: float = _threshold(
        0.7, "causes close so much everywhere", "share of the largest excess", "decisions/gap-verdict.md"
    )
    number: float = _threshold(
        0.2,
        "a number of a simulator's model is off for sure, however little it closes",
        "share of the model's number",
        "decisions/gap-verdict.md",
    )


@dataclass(frozen=True)
class Thresholds:
    """All of them."""

    data: Data = field(default_factory=Data)
    criterion: Criterion = Criterion()
    matters: Matters = Matters()

    def changed(self, name: str, value: float) -> Thresholds:
        """Return them with another value of "group.threshold"; InputError on a name that there is not."""
        group, _, own = name.partition(".")
        if not any(name == each.name for each in self.listed()):
            raise InputError(f'there is no threshold "{name}"; choose from {", ".join(t.name for t in self.listed())}')
        return replace(self, **{group: replace(getattr(self, group), **{own: value})})

    def listed(self) -> Iterator[Threshold]:
        """Return each with its name, "group.threshold", and what is known of it."""
        for group in fields(self):
            values = getattr(self, group.name)
            for threshold in fields(values):
                yield Threshold(f"{group.name}.{threshold.name}", getattr(values, threshold.name), **threshold.metadata)


@dataclass(frozen=True)
class Threshold:
    """One threshold: what it decides, its unit, and where its value comes from."""

    name: str
    value: Any
    meaning: str
    unit: str
    source: str


DEFAULT = Thresholds()
