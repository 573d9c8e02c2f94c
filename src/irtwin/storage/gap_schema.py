"""The tables of a diagnosis: where the gap of twin and robot lies, why, how far it shrinks, what to do next.

All but what concerns the record itself is as the fields of the document tell it (`document.tables`), a class a table:
`CLASSES`. Joints, runs, effects and causes are named as in the document; ranks and numbers count from 1, the first
being the foremost.
"""

from __future__ import annotations

from datetime import datetime
from typing import Any

from sqlalchemy import Boolean, Double, ForeignKey, Integer, String
from sqlalchemy.orm import Mapped, MappedColumn, mapped_column

from irtwin.document.tables import DOCUMENT, TABLES, Column, Table
from irtwin.storage.schema import Base, MadeRow

_TYPES = {str: String, float: Double, int: Integer, bool: Boolean}


class GapDiagnosis(Base):
    """A diagnosis of a robot's gap, with the files that hold it, its curves and the twin with its causes added."""

    __tablename__ = DOCUMENT.name

    diagnosis_id: Mapped[str] = mapped_column(primary_key=True)  # robot_id. and a hash of the diagnosis
    robot_id: Mapped[str] = mapped_column(ForeignKey("robot.robot_id"))
    created: Mapped[datetime]
    file: Mapped[str]
    sha256: Mapped[str]
    evidence_file: Mapped[str]
    evidence_sha256: Mapped[str]
    twin_file: Mapped[str | None]
    twin_sha256: Mapped[str | None]
    motion_file: Mapped[str | None]  # CSV: what to play in the next experiment
    motion_sha256: Mapped[str | None]
    activity_id: Mapped[str] = mapped_column(ForeignKey("activity.activity_id"))


class OfDiagnosis(MadeRow):
    """What each further table begins and ends with."""

    __abstract__ = True

    diagnosis_id: Mapped[str] = mapped_column(ForeignKey("gap_diagnosis.diagnosis_id"), primary_key=True, sort_order=-1)


def _class(table: Table) -> type[OfDiagnosis]:
    columns = {key: mapped_column(String, primary_key=True) for key in table.keys[1:]}
    columns |= {column.name: _column(column) for column in table.columns}
    if table.of_robot:
        columns["robot_id"] = mapped_column(String, nullable=False)
    return type(table.name, (OfDiagnosis,), {"__tablename__": table.name, **columns})


def _column(column: Column) -> MappedColumn[Any]:
    to = [ForeignKey("run.run_id")] if column.name == "run_id" else []
    return mapped_column(_TYPES[column.kind], *to, primary_key=column.key, nullable=column.nullable)


for _told in DOCUMENT.columns:
    setattr(GapDiagnosis, _told.name, _column(_told))
CLASSES = {table.name: _class(table) for table in TABLES if table is not DOCUMENT}
