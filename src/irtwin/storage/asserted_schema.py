"""The table of what users assert, and which columns they may fill."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import Column, ForeignKey, Table
from sqlalchemy.orm import Mapped, mapped_column

from irtwin.storage.schema import Base

# table -> the columns that a user may fill: what a person said in a data set, and what no name or file hangs on
FILLED = {
    "robot": ("type", "manufacturer", "weight_kg", "rated_payload_kg", "ambient_temperature_degc"),
    "robot_note": ("text",),
    "joint": (
        *("lower_limit_rad", "upper_limit_rad", "speed_limit_rad_s", "acceleration_limit_rad_s2", "torque_limit_nm"),
        *("gear_ratio", "rotor_inertia_kg_m2", "torque_constant_nm_a", "winding_resistance_ohm"),
    ),
    "run": ("payload_kg", "product", "pieces", "cycles"),
}


class AssertedFact(Base):
    """A statement of a user. One that a row follows says which; any other is a triple of the graph as it stands."""

    fact_id: Mapped[str] = mapped_column(primary_key=True)
    about_robot: Mapped[str | None] = mapped_column(ForeignKey("robot.robot_id", ondelete="CASCADE"))
    subject: Mapped[str]  # whole IRIs
    predicate: Mapped[str]
    value: Mapped[str | None]  # an IRI, or as a literal is written; none where the row's value was taken out
    kind: Mapped[str]  # "IRI", the IRI of a datatype, or a language with "@" before it
    graph: Mapped[str]  # the named graph
    author: Mapped[str]
    time: Mapped[datetime]
    replaced: Mapped[str | None]  # what the row said before, as it is written
    place: Mapped[str | None]  # table and column, "run.payload_kg"; none where no row follows
    row_key: Mapped[str | None]  # JSON: the row's key, by column

    @property
    def table(self) -> Table:
        """The table whose row follows."""
        return Base.metadata.tables[str(self.place).partition(".")[0]]

    @property
    def column(self) -> Column[Any]:
        """The column that follows."""
        column: Column[Any] = self.table.columns[str(self.place).partition(".")[2]]
        return column
