"""The document of a diagnosis: what JSON, database, graph and page all say.

Torque is in N m (N of a prismatic joint), power in W, position in rad (m of a prismatic joint). A "channel" is torque
or power; or position, where a simulator was told the commands of logs: its residual is the tracking error, what the
robot's positions have beyond the simulator's. What a field is in database and graph stands beside it (`told`).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import chain, count
from typing import Annotated, Any

from irtwin.document import form
from irtwin.document.experiment import Experiment
from irtwin.document.form import Between, OneOf
from irtwin.document.odd_stretch import OddStretch
from irtwin.document.told import Names, part, tells, told
from irtwin.document.words import ONTOLOGY, Channel, Effect, Joint, Measured, Regime, Run
from irtwin.errors import InputError

Share = Annotated[float, Between(0, 1)]
Interval = tuple[float, float]  # 95 %
Verdict = Annotated[str, OneOf("no_gap", "attributed", "ambiguous", "unexplained"), Names(f"{ONTOLOGY}/verdict/{{}}")]
Because = Annotated[
    str, OneOf("much_is_left", "impossible_number", "does_not_repeat", "unsure"), Names(f"{ONTOLOGY}/reason/{{}}")
]
Scope = Annotated[str, OneOf("missing", "changed"), Names(f"{ONTOLOGY}/scope/{{}}")]
ScaleSource = Annotated[str, OneOf("stated", "simulated", "sensor", "assumed")]
FloorSource = Annotated[str, OneOf("repeats", "out_of_band")]
Family = Annotated[str, Names(f"{ONTOLOGY}/family/{{}}")]
CauseId = Annotated[str, Names("gap_cause/{diagnosis_id}/{}", "cause_id")]

LIKELY = 0.5  # confidence from which a cause or finding is likely, not a guess; as limit:confidence_to_act ships (test)
FALSE_PLACES = 0.05  # rate of false discoveries up to which a place is sure, as intervals are 95 % ones
LEAST_SHARE = 0.02  # of its channel's excess that a place has, to be worth a line


@part()
class Size:
    """How large the gap of a channel is: `rmse` and `noise_floor` in its unit; `excess`: mean square / floor² - 1.

    `sensor_noise`: the part of the floor that the fast end of the spectrum shows, as RMS in the filter's band.
    """

    rmse: float = told("Gap_RMSE")
    noise_floor: float | None = told("Noise_Floor")
    excess: float | None = told("Gap_Excess")
    sensor_noise: float | None = told("Sensor_Noise", default=None)


@part("Gap_Size", of="size_of", unit_of="channel")
class SizeAt(Size):
    """The size of the gap in a channel, at its `place`: a joint, or "robot"."""

    channel: Channel = told("located_in_Channel", key=True)
    joint: Joint | None = told("located_in_Joint")
    place: str = told(key=True)


@part()
class Gap:
    """The gap before anything is added: torque or position by joint, power, and the error of the twin's energy, %."""

    energy_error_percent: float | None = told("Energy_Error_Before")
    torque: Mapping[Joint, Size] | None = None
    power: Size | None = None
    position: Mapping[Joint, Size] | None = None

    @property
    @tells()
    def sizes(self) -> tuple[SizeAt, ...]:
        """The sizes, each with its place."""
        joints = [
            SizeAt(channel=channel, joint=at, place=at, **vars(size))
            for channel, sizes in (("torque", self.torque), ("position", self.position))
            for at, size in (sizes or {}).items()
        ]
        power = [SizeAt(channel="power", joint=None, place="robot", **vars(size)) for size in (self.power,) if size]
        return (*joints, *power)


@part("Gap_Location", of="location_of", ranked=True)
class GapLocation:
    """A place of the gap; joint and regime None: the whole robot, any motion.

    `follows`: the variable that the residual goes with; `share` of the channel's excess; `excess` as of a Size;
    `concentration`: its share of its joint's excess over its share of the samples; intervals are over runs.
    """

    channel: Measured = told("located_in_Channel")
    joint: Joint | None = told("located_in_Joint")
    regime: Regime | None = told("located_in_Regime")
    follows: str | None = told("Follows_Variable")
    runs: tuple[Run, ...] | None = told("located_in_Run")
    share: Share = told("Gap_Share")
    share_interval95: Interval = told("Gap_Share")
    excess: float = told("Gap_Excess")
    excess_interval95: Interval = told("Gap_Excess")
    concentration: float = told("Gap_Concentration")
    false_discovery_rate: float = told("False_Discovery_Rate")

    @property
    @tells(key=True)
    def location_id(self) -> str:
        """Its name, such as "torque@joint_2:reversal": a diagnosis names each place once."""
        joint = "" if self.joint is None else f"@{self.joint}"
        return f"{self.channel}{joint}" + ("" if self.regime is None else f":{self.regime}")


@part("Gap_Cause_Parameter", of="parameter_of_Cause", ranked=True)
class CauseParameter:
    """A parameter of a cause, in its `unit`; joint None: of the whole robot, or of all joints of the cause alike.

    Where a simulator has the number, `simulator` is its, `robot` the robot's, and `value` how far these are apart.
    """

    name: str = told("Cause_Parameter_Name")
    joint: Joint | None = told("caused_in_Joint")
    value: float = told("Cause_Parameter_Value")
    unit: str = told()
    interval95: Interval | None = told("Cause_Parameter")
    simulator: float | None = told("Simulator_Value", column="simulator_value", default=None)
    robot: float | None = told("Robot_Value", column="robot_value", default=None)


@part("Gap_Disturbance_Quantity", of="quantity_of_Disturbance", ranked=True)
class DisturbanceQuantity:
    """A number that describes what does not repeat, in its `unit`; `joint` as of a parameter."""

    name: str = told("Quantity_Name")
    joint: Joint | None
    value: float = told("Quantity_Value")
    unit: str = told()
    interval95: Interval | None = told("Quantity")


@part("Gap_Competitor", table="gap_cause_competitor", of="competes_with_Cause")
class Competitor:
    """An effect that could be in a cause's place, whether the data tell it from the cause or not."""

    effect: Effect = told("of_competing_Effect", key=True)
    probability: Share = told("Competitor_Probability")


@part()
class Evidence:
    """Why a cause is held responsible. Shares and probabilities are 0 to 1, the other numbers have no unit.

    `gain`: what it explains beside the other causes, in mean squares of what all leave; `log_odds`, natural: that it is
    there beside the others, against that nothing is in its place. Rivals are the effects that could be, by id.
    `runs` and `window` (s of the clock): where it acts in some runs, or for a while, only.
    """

    channel: Channel = told("located_in_Channel")
    share_of_what_is_closed: float | None = told("Share_Of_Closed", column="share_of_closed")
    closed_where_it_acts: float = told("Closed_Where_It_Acts")
    gain: float = told("Gain")
    log_odds: float = told("Log_Odds", optional=True)  # causes of an earlier criterion have none
    probability_of_rivals: Mapping[Effect, Share]
    runs: tuple[Run, ...] | None = told("acts_in_Run", default=None)
    window: Interval | None = told(
        "Acts_From", "Acts_Until", column="acts_from_s acts_until_s", default=None, with_field="runs"
    )

    @property
    @tells()
    def competitors(self) -> tuple[Competitor, ...]:
        """The rivals, each with its probability."""
        return tuple(
            Competitor(effect=rival, probability=chance) for rival, chance in self.probability_of_rivals.items()
        )


@part("Gap_Cause", of="cause_of", ranked=True)
class Cause:
    """An effect held responsible for part of the gap; `joints` none: it acts on the whole robot.

    `id` names it within the document; `confidence`: its probability against all that could be in its place, nothing
    there included; `folded_away`: where no finding that matters has it, so that the verdict passes it by.
    """

    id: str = told("Cause_ID", column="cause_id", key=True)
    effect: Effect = told("caused_by_Effect")
    joints: tuple[Joint, ...] = told("caused_in_Joint")
    scope: Scope = told("has_Scope")
    confidence: Share = told("Confidence")
    parameters: tuple[CauseParameter, ...] = told()
    indistinguishable_from: tuple[Effect, ...] = told("indistinguishable_from", table="gap_cause_rival")
    evidence: Evidence = told()
    folded_away: bool | None = None

    @property
    def likely(self) -> bool:
        """Whether it is more likely than not, and no guess."""
        return self.confidence >= LIKELY


@part("Gap_Finding_Member", of="member_of_Finding", ranked=True)
class Member:
    """An effect that a finding may be: that of a cause, by its id, or one that the data cannot tell from it.

    `confidence`: of a cause as there; of others their probability in its place.
    """

    cause: CauseId = told("member_by_Cause")
    effect: Effect = told("of_member_Effect")
    family: str
    confidence: Share = told("Confidence")


@part("Gap_Finding", of="finding_of", ranked=True)
class Finding:
    """The answer one level up: causes of one family and scope whose joints overlap, in one channel.

    `joints`: those of the causes that are likely, of all where none is; none: of the whole robot. `confidence`: that
    the family is right, at least that of any of its causes; `share` of the channel's gap that they close together on
    groups left out, `share_of` says of what; `matters`: whether that is worth a word of its own. Members of several
    causes are all there, those of one cause are alternatives.
    """

    id: str = told("Finding_ID", column="finding_id", key=True)
    family: Family = told("has_Family")
    joints: tuple[Joint, ...] = told("found_in_Joint")
    scope: Scope = told("has_Scope")
    channel: Channel = told("located_in_Channel")
    confidence: Share = told("Confidence")
    share: float = told("Closed_Share")
    share_interval95: Interval = told("Closed_Share")
    share_of: str = told("Closed_Share_Of")
    matters: bool = told("Matters")
    members: tuple[Member, ...] = told()

    @property
    def causes(self) -> tuple[str, ...]:
        """The ids of its causes."""
        return tuple(dict.fromkeys(member.cause for member in self.members))


@part("Gap_Disturbance", of="disturbance_of", ranked=True, unit_of="channel")
class NotRepeating:
    """What differs between repeats of a motion beyond noise: `id`, `channel`, `joint` (None: the whole robot), `kind`.

    `rms` of one run, in the channel's unit; `share` of the mean square of all that differs there; `quantities` as of
    a cause: frequency and amplitude, or power, duty and period, or offset, or drift. `explained_by`: a cause's id.
    """

    id: str = told(column="disturbance_id", key=True)
    channel: Channel = told("located_in_Channel")
    joint: Joint | None = told("located_in_Joint")
    kind: Annotated[str, OneOf("line", "band", "switching", "drift", "offset")] = told("Disturbance_Kind")
    rms: float = told("Disturbance_RMS")
    share: Share = told("Disturbance_Share")
    quantities: tuple[DisturbanceQuantity, ...] = told()
    explained_by: CauseId | None = told("explained_by_Cause")


@part("Untestable_Effect", table="gap_not_testable", of="untestable_in", ranked=True)
class Untestable:
    """An effect that the data cannot show, and why."""

    effect: Effect = told("of_untestable_Effect")
    why: str = told("Reason")


@part("Refused_Cause", table="gap_refused", of="refused_in", ranked=True)
class Refused:
    """An effect that would explain the data, but by a number that cannot be true; `why` names it."""

    effect: Effect = told("of_refused_Effect")
    joints: tuple[Joint, ...] = told("refused_at_Joint", column="joint", optional=True)  # one at most
    why: str = told("Reason")


@part()
class TorqueScale:
    """How sure the scale of logged torque is: half its 95 % interval as a share, and where that comes from.

    low, high: what true torque is over logged torque, with what power says; parameters that go with torque carry it.
    """

    uncertainty95: float = told("Torque_Scale_Uncertainty", column="torque_scale_uncertainty")
    source: ScaleSource
    low: float
    high: float
    why: str = told("Torque_Scale_Reason", column="torque_scale_why")


@part()
class Cutoff:
    """The cutoff of the low-pass filter that all runs passed, Hz; whether a user stated it; in words, why so."""

    hz: float = told("Cutoff_Frequency", column="cutoff_hz")
    stated: bool
    why: str = told("Cutoff_Reason", column="cutoff_why")


@part()
class FrictionSpread:
    """By what share of it a joint's dry and viscous friction differ from run to run, one standard deviation.

    None: not known. It counts as noise.
    """

    dry: Share | None = told("Dry_Friction_Spread", column="dry_friction_spread")
    viscous: Share | None = told("Viscous_Friction_Spread", column="viscous_friction_spread")


@part()
class Change:
    """A measure of the gap on runs outside the fit, before and after the causes are added, in the measure's unit."""

    before: float = told("Change_Before")
    after: float = told("Change_After")
    noise_floor: float | None = told("Noise_Floor")
    interval95_after: Interval | None = told("Change_After", column="lower upper")


@part("Gap_Change", of="change_of", unit_of="measure")
class ChangeBy(Change):
    """What changes by all causes "together", by one "alone", or by all "without" one; `place`: its id, or "all"."""

    measure: str = told("Change_Measure", key=True)
    part: str = told("Change_Part", key=True)
    cause: CauseId | None = told("change_by_Cause")
    place: str = told(key=True)


@part("Gap_Shrinkage", of="shrinkage_of")
class ClosedFraction:
    """The share of the gap above the floor that closes, at most 1; below 0 where the causes make it worse.

    Beside a simulator it is of what the twin leaves beyond what it leaves of the simulator's own runs.
    """

    value: float = told("Closed_Fraction", column="closed_fraction")
    interval95: Interval = told("Closed_Fraction", optional=True)


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

    @property
    def changes(self) -> tuple[ChangeBy, ...]:
        """What it changes alone, and all others without it: pooled over joints."""

        def change(part: str, after: Sequence[float]) -> ChangeBy:
            measured = Change(
                before=pooled(self.rmse_before), after=pooled(after), noise_floor=None, interval95_after=None
            )
            return ChangeBy(
                measure=f"{self.channel}_rmse", part=part, cause=self.cause, place=self.cause, **vars(measured)
            )

        return change("alone", self.rmse_alone), change("without", self.rmse_when_left_out)


def pooled(values: Sequence[float]) -> float:
    """Return the root of the mean square over joints."""
    return math.sqrt(sum(value**2 for value in values) / len(values))


@part()
class Shrink:
    """How far the gap shrinks on runs outside the fit: torque in N m, power in W, position in rad, energy in %."""

    held_out_runs: tuple[Run, ...] = told("judged_on", table="gap_held_out")
    noise_floor_from: FloorSource | None = told("Noise_Floor_From")
    torque_rmse: Change | None
    power_rmse: Change | None
    energy_error_percent: Change | None
    closed_fraction: ClosedFraction | None = told()
    by_cause: tuple[CauseChange, ...]
    position_rmse: Change | None = None

    @property
    @tells()
    def changes(self) -> tuple[ChangeBy, ...]:
        """What all causes change together; and each alone, and all without it."""
        of_channels = [
            ChangeBy(measure=measure, part="together", cause=None, place="all", **vars(change))
            for measure in ("torque_rmse", "power_rmse", "position_rmse", "energy_error_percent")
            if (change := getattr(self, measure)) is not None
        ]
        return (*of_channels, *(change for cause in self.by_cause for change in cause.changes))


@part("Gap_Horizon", of="change_of", ranked=True, unit_of="measure", constants=(("Change_Part", "horizon"),))
class Horizon:
    """Tracking error from one horizon to the next, `seconds` after runs were begun anew as the robot was, in rad.

    `before`: of the simulator; `after`: with the causes.
    """

    seconds: float = told("Horizon")
    before: float = told("Change_Before")
    after: float = told("Change_After")

    @property
    @tells("Change_Measure")
    def measure(self) -> str:
        """What is measured."""
        return "position_rmse"


@part("Gap_Diagnosis")
class Document:
    """A diagnosis as it is handed out. Raises InputError where the ids of its causes do not fit together.

    `findings` and `causes` are ordered by what they close, the largest first.
    `unexplained_because`: why the verdict is `unexplained`. The causes leave much of the gap; only a number that cannot
    be true would close it; runs of one motion differ by what no effect explains; or no cause that matters is likely.
    `simulator`: the model that the runs were held against. Where their commands were played through it, `horizons`: how
    its tracking error grows. `odd_stretches`: those of which the twin with its causes leaves most, if there are any.
    `mended`: what was wrong with the logs, or left out of them, when they were read, in lines.
    """

    verdict: Verdict = told("has_Verdict")
    robot: str
    gap: Gap = told()
    locations: tuple[GapLocation, ...] = told()
    findings: tuple[Finding, ...] = told()
    causes: tuple[Cause, ...] = told()
    not_testable: tuple[Untestable, ...] = told()
    shrink: Shrink = told()
    next_experiment: Experiment | None = told()
    unexplained_because: Because | None = told("unexplained_for_Reason", default=None)
    not_repeating: tuple[NotRepeating, ...] | None = told(default=None)  # none: nothing is repeated, or nothing differs
    refused: tuple[Refused, ...] | None = told(default=None)
    torque_scale: TorqueScale | None = told(default=None)
    cutoff: Cutoff | None = told(default=None)
    simulator: str | None = told("Simulator_Model", column="simulator_model", default=None)
    horizons: tuple[Horizon, ...] | None = told(default=None)
    odd_stretches: tuple[OddStretch, ...] | None = told(default=None)
    mended: str | None = told("Mended_In_Logs", column="mended", default=None)
    friction_spread: FrictionSpread | None = told(default=None)

    def __post_init__(self) -> None:
        ids = {cause.id for cause in self.causes}
        if len(ids) < len(self.causes):
            raise InputError("diagnosis.causes: two have one id; give each an id of its own")
        if unknown := {cause.cause for cause in self.shrink.by_cause} - ids:
            raise InputError(f"diagnosis.shrink.by_cause: no cause has the id {min(unknown)}; use those of the causes")
        listed = [cause for finding in self.findings for cause in finding.causes]
        if wrong := ids.symmetric_difference(listed):
            raise InputError(f"diagnosis.findings: {min(wrong)} has to be a cause, and one of a finding's members")
        if len({finding.id for finding in self.findings}) < len(self.findings):
            raise InputError("diagnosis.findings: two have one id; give each an id of its own")

    @property
    def mattering(self) -> tuple[Cause, ...]:
        """The causes of findings that matter, in their order."""
        told = {cause for finding in self.findings if finding.matters for cause in finding.causes}
        return tuple(cause for cause in self.causes if cause.id in told)

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


def cause_ids(causes: Iterable[tuple[str, Sequence[str]]], joints: Sequence[str]) -> list[str]:
    """Return an id for each cause, given as its effect and its joints; `joints`: all of the robot, in order.

    "coulomb_friction@joint_2", "backlash@joint_1+joint_3", "payload" of the whole robot, "copper_loss@all" of every
    joint of several. The second of the same gets "#2".
    """
    ids: list[str] = []
    for effect, on in causes:
        everywhere = len(joints) > 1 and set(on) == set(joints)
        place = "all" if everywhere else "+".join(sorted(on, key=joints.index))
        name = f"{effect}@{place}" if on else effect
        numbered = (f"{name}#{number}" for number in count(2))
        ids.append(next(candidate for candidate in chain([name], numbered) if candidate not in ids))
    return ids
