"""The document of a diagnosis: what JSON, database, graph and page all say.

Torque is in N m (N of a prismatic joint), power in W. A "channel" is torque or power.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from irtwin.document import form
from irtwin.document.experiment import Experiment
from irtwin.document.form import Between, OneOf, goes_with
from irtwin.errors import InputError

Share = Annotated[float, Between(0, 1)]
Interval = tuple[float, float]  # 95 %
Channel = Annotated[str, OneOf("torque", "power")]
Verdict = Annotated[str, OneOf("no_gap", "attributed", "ambiguous", "unexplained")]
Because = Annotated[str, OneOf("much_is_left", "impossible_number", "does_not_repeat", "unsure")]
Scope = Annotated[str, OneOf("missing", "changed")]
ScaleSource = Annotated[str, OneOf("stated", "simulated", "sensor", "assumed")]
FloorSource = Annotated[str, OneOf("repeats", "out_of_band")]

LIKELY = 0.5  # confidence from which a cause or a finding is likely, more so than not; below it is a guess
FALSE_PLACES = 0.05  # rate of false discoveries up to which a place is sure, as intervals are 95 % ones
LEAST_SHARE = 0.02  # of its channel's excess that a place has, to be worth a line


@dataclass(frozen=True, kw_only=True)
class Size:
    """How large the gap of a channel is: `rmse` and `noise_floor` in its unit; `excess`: mean square / floor² - 1.

    `sensor_noise`: the part of the floor that the fast end of the spectrum shows, as RMS in the filter's band.
    """

    rmse: float
    noise_floor: float | None
    excess: float | None
    sensor_noise: float | None = None


@dataclass(frozen=True, kw_only=True)
class Gap:
    """The gap before anything is added: torque by joint, power, and the error of the twin's energy, %."""

    energy_error_percent: float | None
    torque: Mapping[str, Size] | None = None
    power: Size | None = None


@dataclass(frozen=True, kw_only=True)
class Location:
    """A place of the gap; joint and regime None: the whole robot, any motion.

    `follows`: the variable that the residual goes with; `share` of the channel's excess; `excess` as of a Size;
    `concentration`: its share of its joint's excess over its share of the samples; intervals are over runs.
    """

    channel: Channel
    joint: str | None
    regime: str | None
    follows: str | None
    runs: tuple[str, ...] | None
    share: Share
    share_interval95: Interval
    excess: float
    excess_interval95: Interval
    concentration: float
    false_discovery_rate: float


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter of a cause, in its `unit`; joint None: of the whole robot."""

    name: str
    joint: str | None
    value: float
    unit: str
    interval95: Interval | None


@dataclass(frozen=True, kw_only=True)
class Evidence:
    """Why a cause is held responsible. Shares and probabilities are 0 to 1, the other numbers have no unit.

    `gain`: what it explains beside the other causes, in mean squares of what all leave; `log_odds`, natural: that it is
    there beside the others, against that nothing is in its place. Rivals are the effects that could be, by id.
    `runs` and `window` (s of the clock): where it acts in some runs, or for a while, only.
    """

    channel: Channel
    share_of_what_is_closed: float | None
    closed_where_it_acts: float
    gain: float
    log_odds: float
    probability_of_rivals: Mapping[str, Share]
    runs: tuple[str, ...] | None = None
    window: Interval | None = field(default=None, metadata=goes_with("runs"))


@dataclass(frozen=True, kw_only=True)
class Cause:
    """An effect held responsible for part of the gap; `joints` none: it acts on the whole robot.

    `id` names it within the document; `confidence`: its probability against all that could be in its place, nothing
    there included; `folded_away`: where no finding that matters has it, so that the verdict passes it by.
    """

    id: str
    effect: str
    joints: tuple[str, ...]
    scope: Scope
    confidence: Share
    parameters: tuple[Parameter, ...]
    indistinguishable_from: tuple[str, ...]
    evidence: Evidence
    folded_away: bool | None = None

    @property
    def likely(self) -> bool:
        """Whether it is more likely than not, and no guess."""
        return self.confidence >= LIKELY


@dataclass(frozen=True, kw_only=True)
class Member:
    """An effect that a finding may be: that of a cause, by its id, or one that the data cannot tell from it.

    `confidence`: of a cause as there; of others their probability in its place.
    """

    cause: str
    effect: str
    family: str
    confidence: Share


@dataclass(frozen=True, kw_only=True)
class Finding:
    """The answer one level up: causes of one family and scope whose joints overlap, in one channel.

    `joints`: those of the causes that are likely, of all where none is; none: of the whole robot. `confidence`: that
    the family is right, at least that of any of its causes; `share` of the channel's gap that they close together on
    groups left out, `share_of` says of what; `matters`: whether that is worth a word of its own. Members of several
    causes are all there, those of one cause are alternatives.
    """

    id: str
    family: str
    joints: tuple[str, ...]
    scope: Scope
    channel: Channel
    confidence: Share
    share: float
    share_interval95: Interval
    share_of: str
    matters: bool
    members: tuple[Member, ...]

    @property
    def causes(self) -> tuple[str, ...]:
        """The ids of its causes."""
        return tuple(dict.fromkeys(member.cause for member in self.members))


@dataclass(frozen=True, kw_only=True)
class NotRepeating:
    """What differs between repeats of a motion beyond noise: `id`, `channel`, `joint` (None: the whole robot), `kind`.

    `rms` of one run, in the channel's unit; `share` of the mean square of all that differs there; `quantities` as of
    a cause: frequency and amplitude, or power, duty and period, or offset, or drift. `explained_by`: a cause's id.
    """

    id: str
    channel: Channel
    joint: str | None
    kind: Annotated[str, OneOf("line", "band", "switching", "drift", "offset")]
    rms: float
    share: Share
    quantities: tuple[Parameter, ...]
    explained_by: str | None


@dataclass(frozen=True, kw_only=True)
class Untestable:
    """An effect that the data cannot show, and why."""

    effect: str
    why: str


@dataclass(frozen=True, kw_only=True)
class Refused:
    """An effect that would explain the data, but by a number that cannot be true; `why` names it."""

    effect: str
    joints: tuple[str, ...]
    why: str


@dataclass(frozen=True, kw_only=True)
class TorqueScale:
    """How sure the scale of logged torque is: half its 95 % interval as a share, and where that comes from.

    low, high: what true torque is over logged torque, with what power says; parameters that go with torque carry it.
    """

    uncertainty95: float
    source: ScaleSource
    low: float
    high: float
    why: str


@dataclass(frozen=True, kw_only=True)
class Cutoff:
    """The cutoff of the low-pass filter that all runs passed, Hz; whether a user stated it; in words, why so."""

    hz: float
    stated: bool
    why: str


@dataclass(frozen=True, kw_only=True)
class Change:
    """A measure of the gap on runs outside the fit, before and after the causes are added, in the measure's unit."""

    before: float
    after: float
    noise_floor: float | None
    interval95_after: Interval | None


@dataclass(frozen=True, kw_only=True)
class ClosedFraction:
    """The share of the gap above the floor that closes, at most 1; below 0 where the causes make it worse."""

    value: float
    interval95: Interval


@dataclass(frozen=True, kw_only=True)
class CauseChange:
    """What one cause closes: RMSE of each equation of its channel, in the channel's unit.

    `cause`: its id; `share` of what the causes of its channel close together.
    """

    cause: str
    effect: str
    joints: tuple[str, ...]
    scope: Scope
    channel: Channel
    share: float | None
    rmse_before: tuple[float, ...]
    rmse_alone: tuple[float, ...]
    rmse_when_left_out: tuple[float, ...]
    rmse_with_all: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Closeable:
    """How much of a channel's gap could be closed at all, as shares 0 to 1 `of` something; None where there is no gap.

    `closed`: by the causes, refitted to all runs; `by_regression`: by a flexible regression on the motion alone;
    `nameless`: by one of what the causes leave; `closeable`: by the better of the two. Then each equation's.
    """

    closed: float | None
    closeable: float | None
    by_regression: float | None
    nameless: float | None
    closed_by_equation: tuple[float | None, ...]
    closeable_by_equation: tuple[float | None, ...]
    by_regression_by_equation: tuple[float | None, ...]
    nameless_by_equation: tuple[float | None, ...]
    of: str


@dataclass(frozen=True, kw_only=True)
class Shrink:
    """How far the gap shrinks on runs outside the fit: torque in N m, power in W, energy in %."""

    held_out_runs: tuple[str, ...]
    noise_floor_from: FloorSource | None
    torque_rmse: Change | None
    power_rmse: Change | None
    energy_error_percent: Change | None
    closed_fraction: ClosedFraction | None
    by_cause: tuple[CauseChange, ...]
    yardstick: Mapping[str, Closeable]  # by channel


@dataclass(frozen=True, kw_only=True)
class Document:
    """A diagnosis as it is handed out. Raises InputError where the ids of its causes do not fit together.

    `findings` and `causes` are ordered by what they close, the largest first.
    `unexplained_because`: why the verdict is `unexplained`. The causes leave much of the gap; only a number that cannot
    be true would close it; runs of one motion differ by what no effect explains; or no cause that matters is likely.
    """

    verdict: Verdict
    robot: str
    gap: Gap
    locations: tuple[Location, ...]
    findings: tuple[Finding, ...]
    causes: tuple[Cause, ...]
    not_testable: tuple[Untestable, ...]
    shrink: Shrink
    next_experiment: Experiment | None
    unexplained_because: Because | None = None
    not_repeating: tuple[NotRepeating, ...] | None = None  # none where nothing is repeated, or nothing differs
    refused: tuple[Refused, ...] | None = None
    torque_scale: TorqueScale | None = None
    cutoff: Cutoff | None = None  # of the filter that all runs passed

    def __post_init__(self) -> None:
        ids = {cause.id for cause in self.causes}
        if len(ids) < len(self.causes):
            raise InputError("diagnosis.causes: two have one id; give each an id of its own")
        if unknown := {one.cause for one in self.shrink.by_cause} - ids:
            raise InputError(f"diagnosis.shrink.by_cause: no cause has the id {min(unknown)}; use those of the causes")
        found = [cause for finding in self.findings for cause in finding.causes]
        if wrong := ids.symmetric_difference(found):
            raise InputError(f"diagnosis.findings: {min(wrong)} has to be a cause, and one of a finding's members")
        if len({finding.id for finding in self.findings}) < len(self.findings):
            raise InputError("diagnosis.findings: two have one id; give each an id of its own")

    def to_json(self) -> dict[str, Any]:
        """Return the document as JSON, in the form of `schema()`."""
        written: dict[str, Any] = form.to_json(self)
        return written

    @classmethod
    def from_json(cls, given: object) -> Document:
        """Return the document that JSON says. Raises InputError, with the place, where it has another form."""
        return form.from_json(cls, given, "diagnosis")


def schema() -> dict[str, Any]:
    """Return the JSON Schema of a diagnosis: that of `diagnosis.schema.json`, with all that is said beside it."""
    head = {"$schema": "https://json-schema.org/draft/2020-12/schema", "title": "Diagnosis of a sim-to-real gap"}
    return head | form.schema(Document)
