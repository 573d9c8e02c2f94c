"""The thresholds of a diagnosis: every value by which it decides what is said, with its meaning, unit and origin.

A group for each step. `diagnose` takes them whole, and each step its own group; `changed` makes a variant, as
`bench/blind/sweep.py` does. What only sets the effort or precision of an algorithm stands beside that algorithm.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any

from irtwin.errors import InputError

_CASES = "development cases of bench/blind"
_JUDGEMENT = "judgement"


def _threshold(value: Any, meaning: str, unit: str, source: str) -> Any:
    return field(default=value, metadata={"meaning": meaning, "unit": unit, "source": source})


def _given(value: Mapping[str, float], meaning: str, unit: str, source: str) -> Any:
    return field(default_factory=lambda: dict(value), metadata={"meaning": meaning, "unit": unit, "source": source})


_RESIDUAL = "share of the mean square of one equation's residual"
_FLOOR = "floor squared"
_ERRORS = "standard errors between groups"
_P = "probability"


@dataclass(frozen=True)
class Admission:
    """Whether a data set can be diagnosed."""

    least_time: float = _threshold(1.0, "observed runs last so long together", "s", _JUDGEMENT)
    moving_speed: float = _threshold(1e-3, "a joint that moves exceeds it", "rad/s, m/s", "noise of measured speeds")
    moving_range: float = _threshold(1e-3, "a joint that moves spans more", "rad, m", "noise of measured positions")
    fewest_groups: int = _threshold(
        4, "fewer programmed motions are few: blocks of time make the groups", "groups", _CASES
    )


@dataclass(frozen=True)
class GivenTwin:
    """How far the numbers of a twin that is given may be off by now; one standard deviation each."""

    moved: float = _threshold(0.2, "any number", "share of the number", "decisions/gap-a-twin-goes-in.md")
    moved_at_least: float = _threshold(
        0.1, "any number", "share of the catalogue's spread", "decisions/gap-a-twin-goes-in.md"
    )


@dataclass(frozen=True)
class Repeats:
    """Which runs repeat a motion, so that their difference is noise."""

    largest_shift: float = _threshold(1.0, "time between the starts of a motion and its repeat", "s", _JUDGEMENT)
    largest_difference: float = _threshold(
        0.1, "repeats differ in position by no more", "share of the motion's standard deviation", _JUDGEMENT
    )
    stop_band: float = _threshold(
        1.05, "where the stop band begins, from which noise is taken without repeats", "times the cutoff", "the filter"
    )
    steepest_fall: float = _threshold(
        5.0,
        "a spectrum that falls faster up to half the sampling rate was smoothed: it tells no noise",
        "power of the frequency",
        "decisions/gap-smoothed-logs.md",
    )


@dataclass(frozen=True)
class NotRepeating:
    """What differs between repeats of a motion, and is named: a disturbance."""

    alpha: float = _threshold(1e-3, "largest p of a disturbance, for all channels and frequencies", _P, _JUDGEMENT)
    least_size: float = _threshold(
        0.5, "least mean square of a line or a switching", "mean square of what else differs", _JUDGEMENT
    )
    least_slow: float = _threshold(
        0.25,
        "least mean square of an offset or a drift between runs: half of what else differs, or of the sensor's noise",
        "mean square of the larger of both",
        "decisions/gap-not-repeating.md",
    )
    least_noise: float = _threshold(1.0, "least RMS of a line or a switching", "RMS of the sensor's noise", _JUDGEMENT)
    periods: float = _threshold(3.0, "periods of a line in a run, at least", "periods", "the spectrum's resolution")
    highest: float = _threshold(0.95, "lines are looked for up to it", "share of the Nyquist frequency", "the sampling")
    pure: float = _threshold(
        0.6, "one steady wave explains so much of what stands out, or it is a band", "share", _JUDGEMENT
    )
    switching: float = _threshold(0.5, "switching explains so much of what differs", "share", _JUDGEMENT)


@dataclass(frozen=True)
class SameRobot:
    """Whether the other runs are of the robot that was observed."""

    foreign: Mapping[str, float] = _given(
        {"reference": 0.06, "simulated": 0.3},
        "the bodies fitted to the other runs leave more in a joint that is foreign, by their role",
        "share of the joint's mean square",
        "twice what gains of 0.7 or 1.4 on two joints leave; a simulator's masses may be off by tens of percent",
    )
    foreign_joints: int = _threshold(2, "foreign joints make another robot", "joints", _CASES)
    opposed: float = _threshold(0.3, "friction of the other sign, to count", "share of the observed", _JUDGEMENT)
    opposed_joints: float = _threshold(0.5, "joints with opposed friction make another robot", "share", _JUDGEMENT)
    heaviest_load: float = _threshold(
        20.0, "load that may have come or gone (or half the arm's mass)", "kg", "data sheets of arms"
    )


@dataclass(frozen=True)
class Criterion:
    """How likely a structure of effects is: see `docs/how-it-decides.md`."""

    misfit: float = _threshold(
        0.08, "what no effect names, along any effect", "share of the RMS that is left", "decisions/gap-criterion.md"
    )
    misfit_unexplained: float = _threshold(
        0.2, "the same of what is left above the floor", "share of its RMS", "decisions/gap-criterion.md"
    )
    excess: float = _threshold(
        3.5,
        "what is left beyond is no noise, whatever the floor missed, and a gap without a cause",
        _FLOOR,
        "decisions/gap-unexplained-verdict.md",
    )
    certainty: float = _threshold(
        12.0, "how well that share is known", "looks at other robots, effectively", "decisions/gap-criterion.md"
    )
    unknown: float = _threshold(
        0.08, "an effect that the catalogue lacks looks like the cause", _P, "decisions/gap-criterion.md"
    )
    least_rival: float = _threshold(0.1, "an effect is named as a rival of a cause from it", _P, _JUDGEMENT)


@dataclass(frozen=True)
class ScaleOfTorque:
    """How far logged torque may be off on all joints alike; half a 95 % interval each."""

    assumed: float = _threshold(
        0.1, "torque of drives, where the data set states nothing", "share", "decisions/gap-scale-of-torque.md"
    )
    sensor: float = _threshold(0.02, "torque of sensors", "share", "decisions/gap-scale-of-torque.md")
    meter: float = _threshold(0.02, "power of a meter", "share", "decisions/gap-scale-of-torque.md")


@dataclass(frozen=True)
class Detectability:
    """What the data can show."""

    least_visible: float = _threshold(
        0.05, "least that an effect of expected size adds beyond the rest", "mean square of the noise", _CASES
    )


@dataclass(frozen=True)
class Verdict:
    """When the diagnosis abstains."""

    closed: float = _threshold(
        0.7, "causes close so much everywhere", "share of the largest excess", "decisions/gap-unexplained-verdict.md"
    )
    rates: float = _threshold(
        0.1, "rates of logs that differ by more are not alike", "share", "decisions/gap-unexplained-verdict.md"
    )


@dataclass(frozen=True)
class Matters:
    """Which causes close so much that a person is told of them one by one; the rest are counted."""

    least_share: float = _threshold(
        0.02, "least that a cause closes", "share of its channel's gap", "decisions/gap-causes-that-matter.md"
    )
    least_floors: float = _threshold(
        0.5, "least that a cause closes at some joint, RMS", "floors", "decisions/gap-causes-that-matter.md"
    )


@dataclass(frozen=True)
class Places:
    """Which joints and regimes are named."""

    most: int = _threshold(12, "places that are named", "places", "for a reader")
    run_stands_out: float = _threshold(1.5, "a run is named with a place beyond it", _FLOOR, _JUDGEMENT)
    unsuited: float = _threshold(
        0.5,
        "factor on the rank of a regime that does not suit the variable that the residual follows",
        "1",
        "decisions/gap-locations.md",
    )
    fewest_samples: int = _threshold(20, "a regime with fewer says nothing", "samples", _JUDGEMENT)
    fewest_units: int = _threshold(4, "fewer runs are cut in stretches of time", "runs", _JUDGEMENT)


@dataclass(frozen=True)
class Regimes:
    """The bounds of the regimes of motion."""

    standing: float = _threshold(1e-3, "a slower joint stands", "rad/s, m/s", "noise of measured speeds")
    slow: float = _threshold(0.1, "low speed ends", "share of the joint's largest speed", _JUDGEMENT)
    steady: float = _threshold(0.2, "steady speed ends", "share of the joint's largest acceleration", _JUDGEMENT)
    even: float = _threshold(0.1, "the robot's steady speed ends", "share of its largest gain of speed", _JUDGEMENT)
    reversal: float = _threshold(0.1, "time around a change of direction", "s", _JUDGEMENT)
    loaded: float = _threshold(0.5, "a load begins", "share of the largest torque", _JUDGEMENT)
    regenerating: float = _threshold(
        0.05, "power given back begins", "share of the largest mechanical power", _JUDGEMENT
    )
    after_motion: float = _threshold(2.0, "time after the last joint stopped", "s", _JUDGEMENT)


@dataclass(frozen=True)
class NextExperiment:
    """Which experiment is proposed."""

    enough: float = _threshold(5.0, "separation that answers a question", "standard deviations", _JUDGEMENT)
    least_unimitated: float = _threshold(
        0.06,
        "least of a cause that its rival must not imitate",
        "share of its mean square",
        _JUDGEMENT,
    )
    identical: float = _threshold(1e-3, "less apart is the same in other words", "share of its mean square", _JUDGEMENT)
    helps: float = _threshold(1.1, "an experiment worth making separates so much", "times what is", _JUDGEMENT)
    most_rivals: int = _threshold(4, "effects of an ambiguity group that are told apart", "effects", "time it takes")
    least_gap: float = _threshold(
        0.1, "a smaller gap is not parted into what could be closed", "floor's mean square", _JUDGEMENT
    )


@dataclass(frozen=True)
class Thresholds:
    """All of them."""

    admission: Admission = Admission()
    given_twin: GivenTwin = GivenTwin()
    repeats: Repeats = Repeats()
    not_repeating: NotRepeating = NotRepeating()
    same_robot: SameRobot = field(default_factory=SameRobot)
    criterion: Criterion = Criterion()
    scale_of_torque: ScaleOfTorque = ScaleOfTorque()
    detectability: Detectability = Detectability()
    verdict: Verdict = Verdict()
    matters: Matters = Matters()
    places: Places = Places()
    regimes: Regimes = Regimes()
    experiment: NextExperiment = NextExperiment()

    def changed(self, name: str, value: float) -> Thresholds:
        """Return them with another value of "group.threshold"; InputError on a name that there is not."""
        group, _, own = name.partition(".")
        if not any(name == each.name for each in self.listed()):
            raise InputError(f'there is no threshold "{name}"; choose from {", ".join(t.name for t in self.listed())}')
        return replace(self, **{group: replace(getattr(self, group), **{own: value})})

    def listed(self) -> Iterator[Threshold]:
        """Return each with its name, "group.threshold", and what is known of it."""
        for group in fields(self):
            one = getattr(self, group.name)
            for each in fields(one):
                yield Threshold(f"{group.name}.{each.name}", getattr(one, each.name), **each.metadata)


@dataclass(frozen=True)
class Threshold:
    """One threshold: what it decides, its unit, and where its value comes from."""

    name: str
    value: Any
    meaning: str
    unit: str
    source: str


DEFAULT = Thresholds()
