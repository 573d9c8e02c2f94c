"""The table of emissions."""

from __future__ import annotations

from sqlalchemy import ForeignKey
from sqlalchemy.orm import Mapped, mapped_column

from irtwin.storage.schema import Base


class RunEmission(Base):
    """The CO2 that a run's energy stands for. It goes with the energy that it was worked out of."""

    __tablename__ = "run_emission"

    run_id: Mapped[str] = mapped_column(ForeignKey("run_energy.run_id", ondelete="CASCADE"), primary_key=True)
    co2_g: Mapped[float]
    activity_id: Mapped[str] = mapped_column(ForeignKey("activity.activity_id", ondelete="CASCADE"))
