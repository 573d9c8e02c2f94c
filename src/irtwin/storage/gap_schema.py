"""The tables of a diagnosis: where the gap between twin and robot lies, what causes it, how far it shrinks.

Joints, runs, effects and causes are named as in the diagnosis' document; ranks count from 1, the first being the
foremost. The tables of the next experiment are in `experiment_schema`.
"""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from irtwin.storage.schema import Base


class GapDiagnosis(Base):
    """A diagnosis of a robot's gap, with the files that hold it, its curves and the twin with its causes added."""

    __tablename__ = "gap_diagnosis"

    diagnosis_id: Mapped[str] = mapped_column(primary_key=True)  # robot_id. and a hash of the diagnosis
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"))
    verdict: Mapped[str]  # "no_gap", "attributed", "ambiguous" or "unexplained"
    unexplained_because: Mapped[str | None]  # of that verdict, as in the document: "much_is_left", "unsure", ...
    created: Mapped[datetime]
    energy_error_percent: Mapped[float | None]  # before anything is added
    noise_floor_from: Mapped[str | None]  # "repeats" or "out_of_band"
    cutoff_hz: Mapped[float | None]  # of the zero-phase filter
    cutoff_why: Mapped[str | None]  # in words: stated, or how it was found
    torque_scale_uncertainty: Mapped[float | None]  # a share, half a 95 % interval
    torque_scale_why: Mapped[str | None]  # in words
    file: Mapped[str]
    sha256: Mapped[str]
    evidence_file: Mapped[str]
    evidence_sha256: Mapped[str]
    twin_file: Mapped[str | None]
    twin_sha256: Mapped[str | None]
    motion_file: Mapped[str | None]  # CSV: what to play in the next experiment
    motion_sha256: Mapped[str | None]
    activity_id: Mapped[str] = mapped_column(ForeignKey("activity.activity_id"))


class OfDiagnosis(Base):
    """What each further table begins and ends with."""

    __abstract__ = True

    diagnosis_id: Mapped[str] = mapped_column(ForeignKey("gap_diagnosis.diagnosis_id"), primary_key=True, sort_order=-2)
    activity_id: Mapped[str] = mapped_column(ForeignKey("activity.activity_id"), sort_order=100)


class OfLocation(OfDiagnosis):
    """Of a location, which is unique within the diagnosis; the same below."""

    __abstract__ = True

    location_id: Mapped[str] = mapped_column(primary_key=True, sort_order=-1)


class OfFinding(OfDiagnosis):
    """Of a finding."""

    __abstract__ = True

    finding_id: Mapped[str] = mapped_column(primary_key=True, sort_order=-1)


class OfDisturbance(OfDiagnosis):
    """Of what does not repeat."""

    __abstract__ = True

    disturbance_id: Mapped[str] = mapped_column(primary_key=True, sort_order=-1)


class OfCause(OfDiagnosis):
    """Of a cause."""

    __abstract__ = True

    cause_id: Mapped[str] = mapped_column(primary_key=True, sort_order=-1)


class GapSize(OfDiagnosis):
    """The gap of one channel before anything is added: torque of a joint, or power."""

    __tablename__ = "gap_size"

    channel: Mapped[str] = mapped_column(primary_key=True)  # "torque" or "power"
    place: Mapped[str] = mapped_column(primary_key=True)  # the joint's name, "robot" for power
    joint: Mapped[str | None]
    robot_id: Mapped[str]
    rmse: Mapped[float]
    noise_floor: Mapped[float | None]
    excess: Mapped[float | None]  # mean square over that of the floor, less 1
    sensor_noise: Mapped[float | None]
    unit: Mapped[str]


class GapRegimeExcess(OfDiagnosis):
    """The excess of one joint in one regime; none where it did not move so, or no floor is known."""

    __tablename__ = "gap_regime_excess"

    joint: Mapped[str] = mapped_column(primary_key=True)
    regime: Mapped[str] = mapped_column(primary_key=True)
    rank: Mapped[int]  # of the regime
    robot_id: Mapped[str]
    excess: Mapped[float | None]


class GapRunChange(OfDiagnosis):
    """What all causes together change in one run, or in one stretch of it, while it is held out of the fit."""

    __tablename__ = "gap_run_change"

    number: Mapped[int] = mapped_column(primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"))
    robot_id: Mapped[str]
    measure: Mapped[str]  # "torque_rmse" of a joint, or "power_rmse"
    joint: Mapped[str | None]
    before: Mapped[float | None]
    after: Mapped[float | None]
    noise_floor: Mapped[float | None]
    unit: Mapped[str]


class GapLocation(OfLocation):
    """A place where part of the gap lies."""

    __tablename__ = "gap_location"

    rank: Mapped[int]
    robot_id: Mapped[str]
    channel: Mapped[str]
    joint: Mapped[str | None]
    regime: Mapped[str | None]
    follows: Mapped[str | None]  # the variable that the residual goes with
    share: Mapped[float]  # of the gap, 0 to 1
    share_lower: Mapped[float]
    share_upper: Mapped[float]
    excess: Mapped[float]  # mean square over that of the floor, less 1
    excess_lower: Mapped[float]
    excess_upper: Mapped[float]
    concentration: Mapped[float]  # share of its joint's excess over its share of the samples
    false_discovery_rate: Mapped[float]


class GapLocationRun(OfLocation):
    """A run in which a location was seen; none where all runs show it."""

    __tablename__ = "gap_location_run"

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)


class GapFinding(OfFinding):
    """Causes of one family and scope whose joints overlap: the answer one level above the effects."""

    __tablename__ = "gap_finding"

    rank: Mapped[int]
    robot_id: Mapped[str]
    family: Mapped[str]  # "friction", "load", ...
    scope: Mapped[str]  # "missing" or "changed"
    channel: Mapped[str]  # "torque" or "power"
    confidence: Mapped[float]  # that the family is right
    share: Mapped[float]  # of the channel's gap that closes; may be below 0
    share_lower: Mapped[float]
    share_upper: Mapped[float]
    share_of: Mapped[str]  # in words: what the share is of
    matters: Mapped[bool]  # whether it is worth a word of its own


class GapFindingJoint(OfFinding):
    """A joint of a finding; none for the whole robot."""

    __tablename__ = "gap_finding_joint"

    joint: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str]


class GapFindingMember(OfFinding):
    """An effect that a finding may be: that of a cause, or one that the data cannot tell from it."""

    __tablename__ = "gap_finding_member"

    number: Mapped[int] = mapped_column(primary_key=True)
    cause_id: Mapped[str]
    effect: Mapped[str]
    confidence: Mapped[float]


class GapDisturbance(OfDisturbance):
    """What differs between repeats of a motion, beyond noise."""

    __tablename__ = "gap_disturbance"

    rank: Mapped[int]
    robot_id: Mapped[str]
    channel: Mapped[str]
    joint: Mapped[str | None]
    kind: Mapped[str]  # "line", "band", "switching", "drift" or "offset"
    rms: Mapped[float]  # of one run
    unit: Mapped[str]
    share: Mapped[float]  # of what differs in its channel and joint, 0 to 1
    cause_id: Mapped[str | None]  # the cause that explains it


class GapDisturbanceQuantity(OfDisturbance):
    """A number that describes a disturbance, with its 95 % interval."""

    __tablename__ = "gap_disturbance_quantity"

    number: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str]
    value: Mapped[float]
    unit: Mapped[str]
    lower: Mapped[float | None]
    upper: Mapped[float | None]


class GapCause(OfCause):
    """An effect held responsible for part of the gap."""

    __tablename__ = "gap_cause"

    rank: Mapped[int]
    robot_id: Mapped[str]
    effect: Mapped[str]
    scope: Mapped[str]  # "missing" or "changed"
    confidence: Mapped[float]
    channel: Mapped[str]  # "torque" or "power"
    share_of_closed: Mapped[float | None]  # of what the causes of its channel close together; may be below 0
    closed_where_it_acts: Mapped[float]  # share of the gap there, 0 to 1, that all causes close
    gain: Mapped[float]  # beside the other causes, in mean squares of what all leave; of old, on groups left out
    log_odds: Mapped[float | None]  # natural, against nothing in its place; none where it was judged before there were
    acts_from_s: Mapped[float | None]  # of the run's clock, where it acts for a while only
    acts_until_s: Mapped[float | None]


class GapCauseJoint(OfCause):
    """A joint that a cause acts on; none for an effect of the whole robot."""

    __tablename__ = "gap_cause_joint"

    joint: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str]


class GapCauseRival(OfCause):
    """An effect that the data do not tell from a cause."""

    __tablename__ = "gap_cause_rival"

    effect: Mapped[str] = mapped_column(primary_key=True)


class GapCauseCompetitor(OfCause):
    """An effect that could be in a cause's place, whether the data tell it from the cause or not."""

    __tablename__ = "gap_cause_competitor"

    effect: Mapped[str] = mapped_column(primary_key=True)
    probability: Mapped[float]  # 0 to 1, beside the cause's confidence


class GapCauseRun(OfCause):
    """A run in which a cause acts; none where it acts in all of them."""

    __tablename__ = "gap_cause_run"

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)


class GapCauseParameter(OfCause):
    """A parameter of a cause with its 95 % interval."""

    __tablename__ = "gap_cause_parameter"

    number: Mapped[int] = mapped_column(primary_key=True)
    robot_id: Mapped[str]
    joint: Mapped[str | None]
    name: Mapped[str]
    value: Mapped[float]
    unit: Mapped[str]
    lower: Mapped[float | None]
    upper: Mapped[float | None]


class GapChange(OfDiagnosis):
    """What changes on runs outside the fit: by all causes, by one alone, or by all but one."""

    __tablename__ = "gap_change"

    measure: Mapped[str] = mapped_column(primary_key=True)  # "torque_rmse", "power_rmse" or "energy_error_percent"
    part: Mapped[str] = mapped_column(primary_key=True)  # "together", "alone" or "without"
    place: Mapped[str] = mapped_column(primary_key=True)  # the cause's id, "all" for all of them
    cause_id: Mapped[str | None]
    before: Mapped[float]
    after: Mapped[float]
    noise_floor: Mapped[float | None]
    lower: Mapped[float | None]  # of what is left
    upper: Mapped[float | None]
    unit: Mapped[str]


class GapShrinkage(OfDiagnosis):
    """Share of the gap above the floor that closes with all causes added."""

    __tablename__ = "gap_shrinkage"

    closed_fraction: Mapped[float]
    lower: Mapped[float | None]
    upper: Mapped[float | None]


class GapCloseable(OfDiagnosis):
    """How much of a channel's gap could be closed at all, as shares 0 to 1; none where there is no gap."""

    __tablename__ = "gap_closeable"

    channel: Mapped[str] = mapped_column(primary_key=True)
    of_what: Mapped[str]  # in words: what the shares are of
    closed: Mapped[float | None]  # by the causes, refitted to all runs
    closeable: Mapped[float | None]  # by the causes or a flexible regression, the better of the two
    by_regression: Mapped[float | None]  # by a flexible regression alone
    nameless: Mapped[float | None]  # by a flexible regression of what the causes leave


class GapHeldOut(OfDiagnosis):
    """A run on which the shrinkage was judged."""

    __tablename__ = "gap_held_out"

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)


class GapNotTestable(OfDiagnosis):
    """An effect that the data cannot show, and why."""

    __tablename__ = "gap_not_testable"

    number: Mapped[int] = mapped_column(primary_key=True)
    effect: Mapped[str]
    why: Mapped[str]


class GapRefused(OfDiagnosis):
    """An effect that would explain the data, but by a number that cannot be true; joint NULL: of the whole robot."""

    __tablename__ = "gap_refused"

    number: Mapped[int] = mapped_column(primary_key=True)
    robot_id: Mapped[str]
    effect: Mapped[str]
    joint: Mapped[str | None]
    why: Mapped[str]
