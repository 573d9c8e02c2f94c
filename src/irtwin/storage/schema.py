"""The relational schema: what is stored of robots, runs, twins and what providers made of them.

Every column that leaves for the graph says its unit in its name. Rows that a provider made carry its activity,
so that they can be dropped and made again.
"""

from __future__ import annotations

import re
from datetime import UTC, datetime
from typing import Annotated, Any, ClassVar

from sqlalchemy import DateTime, Dialect, ForeignKey
from sqlalchemy.orm import DeclarativeBase, Mapped, declared_attr, mapped_column
from sqlalchemy.types import TypeDecorator

LIVE = "live"  # provider of what is known of runs that are watched
METER = "meter"  # provider of what was measured of a run's power
# Kinds of run, by their classes in the ontology: made up, taken in as a log, watched while it lasted, a log played so.
PLANNED_RUN, MEASURED_RUN, LIVE_RUN, REPLAYED_RUN = "Planned_Run", "Measured_Run", "Live_Run", "Replayed_Run"
WATCHED_RUNS = (LIVE_RUN, REPLAYED_RUN)
SIMULATED = "simulated"  # the role of a run whose log a simulator wrote
MEASURED, PLANNED, MODELLED = "measured", "planned", "modelled"  # kinds of series
_WORD = re.compile(r"(?<=[a-z])(?=[A-Z])|(?<=[A-Z])(?=[A-Z][a-z])")  # between two words of a class's name


class Moment(TypeDecorator[datetime]):
    """A time kept as UTC in a column without time zone, so that every database gives it back alike.

    A time without zone is taken to be UTC.
    """

    impl = DateTime
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Return the moment in UTC, its zone taken off."""
        return None if value is None else in_utc(value).replace(tzinfo=None)

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Return the moment with its zone."""
        return None if value is None else value.replace(tzinfo=UTC)


def in_utc(moment: datetime) -> datetime:
    """Return the moment in UTC; one without zone is taken to be UTC."""
    return moment.replace(tzinfo=UTC) if moment.tzinfo is None else moment.astimezone(UTC)


def moment_of(seconds: float) -> datetime:
    """Return a time, s since 1970, as a column keeps it: in UTC, without its zone."""
    return datetime.fromtimestamp(seconds, UTC).replace(tzinfo=None)


class Base(DeclarativeBase):
    """The registry of tables."""

    type_annotation_map: ClassVar[dict[Any, Any]] = {datetime: Moment}

    @declared_attr.directive
    def __tablename__(cls) -> str:
        """Return what a class's table is called: run_energy of RunEnergy, dh_table of DHTable, run of RunRow.

        `Row` stands where what the rows are of has a class of its own elsewhere.
        """
        return _WORD.sub("_", cls.__name__.removesuffix("Row")).lower()


class MadeRow(Base):
    """A row that a provider made, with its activity."""

    __abstract__ = True

    activity_id: Mapped[str] = mapped_column(ForeignKey("activity.activity_id"), sort_order=100)


class Individuals(Base):
    """What the IRIs of all individuals begin with: one row, or none where it is the default."""

    base_iri: Mapped[str] = mapped_column(primary_key=True)


class RobotRow(Base):
    """An industrial robot (Yan 2018, eqs. 10, 12); `robot_id` is the end of its IRI."""

    robot_id: Mapped[str] = mapped_column(primary_key=True)
    name: Mapped[str]
    type: Mapped[str | None]
    manufacturer: Mapped[str | None]
    weight_kg: Mapped[float | None]
    controlled_axes: Mapped[int]
    arm_movement_type: Mapped[str | None]
    rated_payload_kg: Mapped[float | None]
    ambient_temperature_degc: Mapped[float | None]
    power_measured_at: Mapped[str | None]  # none where nobody said
    simulated: Mapped[bool]
    urdf: Mapped[str]
    urdf_sha256: Mapped[str]
    twin_effects: Mapped[str | None]  # comma separated: what the data set says that its twin models
    cutoff_hz: Mapped[float | None]  # of the filter, where the data set states it
    notes: Mapped[str]  # JSON: what the data set says beside the contract; for the graph in `robot_note`


class RobotNote(Base):
    """A thing that a data set says of its robot beside the contract: one value under one name."""

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)  # of a table within the table: "supply.voltage"
    number: Mapped[int] = mapped_column(primary_key=True)  # from 1 on, of the values in a list
    text: Mapped[str]


class SourceFile(Base):
    """A file of a data set that says what its runs are of; `source_file_id` is `robot_id.` and a name of its path."""

    source_file_id: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"))
    kind: Mapped[str]  # "data set": dataset.toml, or "URDF"
    path: Mapped[str]  # from the data set's folder
    folder: Mapped[str]  # of the data set, when it was taken in
    sha256: Mapped[str]


class JointRow(Base):
    """A moving joint of a robot, with its limits and data sheet."""

    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"), primary_key=True)
    name: Mapped[str] = mapped_column(primary_key=True)
    position: Mapped[int]  # 1 for the joint next to the base
    kind: Mapped[str]
    lower_limit_rad: Mapped[float | None]
    upper_limit_rad: Mapped[float | None]
    speed_limit_rad_s: Mapped[float | None]
    acceleration_limit_rad_s2: Mapped[float | None]
    torque_limit_nm: Mapped[float | None]
    gear_ratio: Mapped[float | None]
    rotor_inertia_kg_m2: Mapped[float | None]
    torque_constant_nm_a: Mapped[float | None]
    winding_resistance_ohm: Mapped[float | None]


# Deferred: a run may stand before the one that it names.
OtherRun = Annotated[str | None, mapped_column(ForeignKey("run.run_id", deferrable=True, initially="DEFERRED"))]


class RunRow(Base):
    """One motion, recorded or planned (Yan 2018, eq. 11); `run_id` is `robot_id.name`."""

    run_id: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"))
    name: Mapped[str]
    kind: Mapped[str]  # PLANNED_RUN, MEASURED_RUN, LIVE_RUN or REPLAYED_RUN
    role: Mapped[str | None]  # as the data set says; none for a run of no data set, which another one leaves as it is
    payload_kg: Mapped[float]
    payload_com_x_m: Mapped[float]
    payload_com_y_m: Mapped[float]
    payload_com_z_m: Mapped[float]
    repeat_of: Mapped[OtherRun]
    performs: Mapped[OtherRun]  # the planned run that it carried out
    time_scaling_of: Mapped[OtherRun]  # the measured run that a plan is, made slower
    time_scale: Mapped[float | None]  # how many times longer the plan takes
    product: Mapped[str | None]  # what it made, as the data set says
    pieces: Mapped[int | None]  # how many of them
    cycles: Mapped[int | None]  # how often its programme ran
    start_time: Mapped[datetime | None]  # the log's `started`, else when it was taken in; a plan has none
    start_time_from: Mapped[str | None]  # "log" or "ingest"
    started: Mapped[datetime | None]  # as an activity: none where nobody knows when it was, and of a plan
    ended: Mapped[datetime | None]  # none while it lasts, too
    run_time_s: Mapped[float]
    sample_count: Mapped[int]
    sample_rate_hz: Mapped[float | None]  # none of a single sample
    file: Mapped[str]
    sha256: Mapped[str]


class Series(Base):
    """A Parquet file of a run's samples: as measured or planned, or as a twin models them."""

    series_id: Mapped[str] = mapped_column(primary_key=True)  # sha256 of the Parquet file
    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    kind: Mapped[str]  # MEASURED, PLANNED or MODELLED
    path: Mapped[str]  # inside the workspace
    row_count: Mapped[int]
    columns: Mapped[str]  # comma separated
    activity_id: Mapped[str | None] = mapped_column(ForeignKey("activity.activity_id"))


class Activity(Base):
    """One execution of a provider on one individual."""

    activity_id: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"))  # the robot that it was about
    provider: Mapped[str]  # end of the provider's IRI
    subject: Mapped[str]  # IRI of the individual it worked on, below the workspace's base
    started: Mapped[datetime]
    ended: Mapped[datetime]
    software: Mapped[str]  # "irtwin 0.1.0"


def relation_to(read: str) -> str:
    """Return the term of PROV that leads from an activity to what it read, by its IRI below the workspace's base.

    A run is an activity too, and no entity.
    """
    return "wasInformedBy" if read.startswith("run/") else "used"


class ActivityUse(Base):
    """What an activity read: a run, a run's series or a twin, by its IRI below the workspace's base."""

    activity_id: Mapped[str] = mapped_column(ForeignKey("activity.activity_id"), primary_key=True)
    entity: Mapped[str] = mapped_column(primary_key=True)
    relation: Mapped[str]  # as PROV names it, see `relation_to`


class RunState(MadeRow):
    """How a run passed, and the robot's state at its last sample."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    current_state: Mapped[str]  # "moving" or "standstill"
    idle_share: Mapped[float]  # of the run's time, 0 to 1


class JointState(MadeRow):
    """A joint at the last sample of a run."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    joint: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str]
    joint_position_rad: Mapped[float]
    joint_speed_rad_s: Mapped[float | None]
    joint_acc_rad_s2: Mapped[float | None]
    joint_torque_nm: Mapped[float | None]
    joint_temperature_degc: Mapped[float | None]


class LiveState(MadeRow):
    """How far a live run is, and how well the graph kept up with it."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    state_time: Mapped[datetime]  # of the joint states that the graph shows
    superseded_states: Mapped[int | None]  # never shown, as a newer one was there; none where a crash forgot them
    waited_s: Mapped[float | None]  # that the source was made to wait for storage; likewise
    standing_since: Mapped[datetime | None]  # none while the robot moves, and where the run is over
    standing_s: Mapped[float | None]  # whole seconds, likewise
    stream_state: Mapped[str]  # "flowing", "stale" or "ended"
    stale_since: Mapped[datetime | None]  # by this machine's clock, as are the next: of the last good state
    stale_reason: Mapped[str | None]


class GapState(MadeRow):
    """How far a live run's torque at a joint, or its power, is from its twin now, beside what is usual for it."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    place: Mapped[str] = mapped_column(primary_key=True)  # the joint whose torque it is of, or "robot": its power
    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"))
    robot_id: Mapped[str]
    channel: Mapped[str]  # "torque" or "power"
    joint: Mapped[str | None]
    unit: Mapped[str]  # of residuals, as QUDT names it: "N-M" or "W", "N" at a joint that slides
    residual: Mapped[float]  # root mean square of the last two seconds
    band: Mapped[float]  # what that seldom exceeds on runs that the twin knows, likewise
    ratio: Mapped[float]  # residual / band
    state: Mapped[str]  # "inside" or "outside"
    since: Mapped[datetime]


class GapExcursion(MadeRow):
    """A time that the gap of a live run was outside its band."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    place: Mapped[str] = mapped_column(primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)  # from 1 on, of the run and place
    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"))
    robot_id: Mapped[str]
    channel: Mapped[str]
    joint: Mapped[str | None]
    unit: Mapped[str]  # of residuals, as QUDT names it: "N-M" or "W", "N" at a joint that slides
    began: Mapped[datetime]
    ended: Mapped[datetime | None]  # none while it lasts
    lasted_s: Mapped[float]  # so far
    peak_residual: Mapped[float]
    peak_ratio: Mapped[float]


class TwinRow(MadeRow):
    """An identified twin of a robot; `twin_id` is `robot_id.` and a hash of what made it."""

    twin_id: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"))
    created: Mapped[datetime]
    file: Mapped[str]
    sha256: Mapped[str]
    cutoff_hz: Mapped[float | None]  # of the zero-phase filter
    cutoff_why: Mapped[str | None]  # in words: stated, or how it was found
    condition_number: Mapped[float | None]  # of the scaled base regressor
    base_parameter_count: Mapped[int | None]
    split: Mapped[str]  # in words: which data were fitted, which held out
    torque_scale_uncertainty: Mapped[float | None]  # a share, half a 95 % interval; none where no torque was fitted
    torque_scale_why: Mapped[str | None]  # in words


class ImprovementRound(MadeRow):
    """A try to better a robot's twin by what was logged since; `round_id` is `robot_id.` and its number.

    Twins are named by their ids alone: one that was replaced has no row any more.
    """

    round_id: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"))
    number: Mapped[int]
    tried: Mapped[str]  # "same effects", "effects that the data show" or "effects of a diagnosis"
    effects: Mapped[str]  # comma separated
    earlier_twin_id: Mapped[str]
    tried_twin_id: Mapped[str]
    error_before_percent: Mapped[float]  # worst energy error of what neither twin was fitted to
    error_after_percent: Mapped[float]
    limit_percent: Mapped[float]
    outcome: Mapped[str]  # "within the limit", "better" or "no better"


class TwinEffect(MadeRow):
    """An effect that a twin is made of."""

    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"), primary_key=True)
    effect: Mapped[str] = mapped_column(primary_key=True)


class TwinChoice(MadeRow):
    """An effect that was chosen by what the fitted runs show, or that they could not tell, and what it is worth.

    Worth is on groups of runs left out of the fit in turn, without the effect and with it.
    """

    choice_id: Mapped[str] = mapped_column(primary_key=True)  # `twin_id.effect.` and "chosen" or "open"
    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"))
    effect: Mapped[str]
    joints: Mapped[str | None]  # comma separated; none for an effect of the whole robot
    chosen: Mapped[bool]
    probability: Mapped[float]
    rivals: Mapped[str | None]  # comma separated
    rmse_unit: Mapped[str | None]  # "N m" or "N" of torque, "W" of power
    rmse_without: Mapped[float | None]
    rmse_with: Mapped[float | None]
    energy_error_without_percent: Mapped[float | None]
    energy_error_with_percent: Mapped[float | None]


class TwinRun(MadeRow):
    """The part that a run took in a twin: "fit", "held_out", "both" where it was cut in time, "apart" where neither."""

    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"), primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    part: Mapped[str]
    held_out_from_s: Mapped[float | None]  # of the log's time, where the run was cut in time


class ParameterRow(MadeRow):
    """An identified parameter with its 95 % interval."""

    parameter_id: Mapped[str] = mapped_column(primary_key=True)  # twin_id.effect.joint or link.name
    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"))
    robot_id: Mapped[str]
    effect: Mapped[str]
    joint: Mapped[str | None]
    name: Mapped[str]
    value: Mapped[float]
    unit: Mapped[str]  # symbol: "N m s/rad"
    lower: Mapped[float | None]
    upper: Mapped[float | None]
    scaled_lower: Mapped[float | None]  # with the scale of torque in it; none where it does not go with that
    scaled_upper: Mapped[float | None]


class BaseParameterRow(MadeRow):
    """A combination of torque coefficients that the measured torque shows, with its 95 % interval."""

    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)
    combination: Mapped[str]
    value: Mapped[float]
    unit: Mapped[str]
    lower: Mapped[float]
    upper: Mapped[float]
    scaled_lower: Mapped[float | None]  # as a parameter's
    scaled_upper: Mapped[float | None]


class TorqueFit(MadeRow):
    """How well a twin's torque follows the measured one, per run, joint and part."""

    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"), primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    joint: Mapped[str] = mapped_column(primary_key=True)
    part: Mapped[str] = mapped_column(primary_key=True)  # "fit" or "held_out"
    robot_id: Mapped[str]
    rmse_nm: Mapped[float]
    r_squared: Mapped[float | None]  # none where the measured torque does not vary


def _own_activity(context: Any) -> str:
    return str(context.get_current_parameters()["activity_id"])


class RunEnergy(MadeRow):
    """Energy and power of a run: as measured and as its twin models them."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    twin_id: Mapped[str | None] = mapped_column(ForeignKey("twin.twin_id"))  # none of a live run of a robot without one
    part: Mapped[str | None]  # the run's part in the twin; one "apart" is not judged by it
    energy_consumption_j: Mapped[float | None]  # that a robot took: none of a replay, and of a simulated run
    energy_from: Mapped[str]  # "measured", "modelled", or "mechanical": modelled without the electrical losses
    run_power_w: Mapped[float]  # its mean
    peak_power_w: Mapped[float]
    measured_energy_j: Mapped[float | None]
    modelled_energy_j: Mapped[float | None]
    energy_error_percent: Mapped[float | None]  # the seed's (15); of the part held out, where the run was cut
    power_rmse_w: Mapped[float | None]  # likewise
    standby_energy_j: Mapped[float | None]
    standby_share: Mapped[float | None]  # of the modelled energy, 0 to 1
    returned_energy_j: Mapped[float | None]  # mechanical energy that the joints gave back while they braked, positive
    # whose work the energy taken is: of who read the meter, else of who asked the twin
    taken_activity_id: Mapped[str] = mapped_column(
        ForeignKey("activity.activity_id"), default=_own_activity, sort_order=101
    )
