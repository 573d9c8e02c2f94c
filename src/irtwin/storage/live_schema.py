"""What is stored of the gap of a live run: how far its robot was from its twin."""

from __future__ import annotations

from datetime import datetime

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from irtwin.storage.schema import Made


class GapState(Made):
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


class GapExcursion(Made):
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
