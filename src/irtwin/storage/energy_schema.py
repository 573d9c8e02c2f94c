"""The tables of where energy goes: the ledger of a run, what a plan will take, what a saving action saved."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from irtwin.storage.schema import MadeRow


class RunPrice(MadeRow):
    """What a planned run will take by its robot's twin, with 95 % intervals.

    The twin is named by its id alone: one that was replaced has no row any more, and the price stays what it was.
    """

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    twin_id: Mapped[str]
    energy_from: Mapped[str]  # "modelled", or "mechanical": without the electrical losses
    energy_j: Mapped[float]
    energy_lower_j: Mapped[float | None]
    energy_upper_j: Mapped[float | None]
    mean_power_w: Mapped[float]
    mean_power_lower_w: Mapped[float | None]
    mean_power_upper_w: Mapped[float | None]
    peak_power_w: Mapped[float]
    peak_power_lower_w: Mapped[float | None]
    peak_power_upper_w: Mapped[float | None]
    saving_j: Mapped[float | None]  # of a time scaling, against the motion as it was with waiting after it
    saving_lower_j: Mapped[float | None]
    saving_upper_j: Mapped[float | None]


class SavingVerification(MadeRow):
    """What the runs before and after a saving action say that it saved, with a 95 % interval."""

    action: Mapped[str] = mapped_column(primary_key=True)  # its whole IRI
    robot_id: Mapped[str]
    result: Mapped[str]  # "verified", "not verified" or "too few runs": then nothing stands in what follows the counts
    runs_before: Mapped[int]
    runs_after: Mapped[int]
    compared_for: Mapped[str | None]  # "piece", "cycle" or "hour"
    adjusted_baseline_j: Mapped[float | None]
    saving_j: Mapped[float | None]
    saving_lower_j: Mapped[float | None]
    saving_upper_j: Mapped[float | None]


class EnergyShare(MadeRow):
    """The ledger: energy of one effect, in one joint where it has one, over a run."""

    twin_id: Mapped[str] = mapped_column(ForeignKey("twin.twin_id"), primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    effect: Mapped[str] = mapped_column(primary_key=True)
    place: Mapped[str] = mapped_column(primary_key=True)  # the joint, or "robot" for an effect of the whole robot
    joint: Mapped[str | None]
    robot_id: Mapped[str]
    energy_j: Mapped[float]
    lower_j: Mapped[float | None]  # of the 95 % interval; none of a live run
    upper_j: Mapped[float | None]
    inseparable: Mapped[int | None]  # number of the InseparableEnergy that it is part of


class InseparableEnergy(MadeRow):
    """Energy of shares of a run that the data do not part, with its 95 % interval."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)  # from 1 on
    robot_id: Mapped[str]
    energy_j: Mapped[float]
    lower_j: Mapped[float]
    upper_j: Mapped[float]


class MeteredLoad(MadeRow):
    """What the power of a run says that a meter alone logged: its standby, the cycles in it, its energy by hour."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    standby_power_w: Mapped[float | None]  # none where no lower level of power was found
    cycle_count: Mapped[int | None]  # none where none were found, as in the next two
    cycle_time_s: Mapped[float | None]
    cycle_energy_j: Mapped[float | None]
    first_hour: Mapped[datetime]  # begin of the hour of the clock in which the run began
    energy_by_hour_j: Mapped[str]  # from then on, comma separated


class SupplyStateRow(MadeRow):
    """A state of the supply in a run: how long, and its mean power by the log and by the twin, with a 95 % interval."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    number: Mapped[int] = mapped_column(primary_key=True)  # from 1 on
    robot_id: Mapped[str]
    state: Mapped[str]  # "off", "moving", "brakes closed", "drives on at rest"; by a meter alone "standby", "working"
    seconds: Mapped[float]
    power_w: Mapped[float | None]  # none where none was logged
    modelled_power_w: Mapped[float | None]  # none without a twin
    modelled_power_lower_w: Mapped[float | None]
    modelled_power_upper_w: Mapped[float | None]
    differs: Mapped[bool]  # the log's power lies outside the twin's interval


class JointEnergy(MadeRow):
    """The ledger summed over effects: what one joint took over a run."""

    run_id: Mapped[str] = mapped_column(ForeignKey("run.run_id"), primary_key=True)
    joint: Mapped[str] = mapped_column(primary_key=True)
    robot_id: Mapped[str]
    energy_j: Mapped[float]
