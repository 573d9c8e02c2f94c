"""What users assert: each statement with its author and time, and what it replaced; rows follow it.

A statement about a column that a user may fill is followed by its row, in the data set of that robot too whenever it
is taken in again. It lapses where the data set has come to say something that the user did not know of.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from datetime import datetime
from typing import Any

from sqlalchemy import Column, ForeignKey, Table, exists, select
from sqlalchemy.orm import Mapped, Session, mapped_column

from irtwin.storage.schema import Base, TwinRow

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


def written(value: object) -> str | None:
    """Return a column's value as facts write it."""
    return None if value is None else repr(value) if isinstance(value, float) else str(value)


def follow(rows: Iterable[Base], facts: Sequence[AssertedFact]) -> list[str]:
    """Have the rows of a data set say what facts say, the earliest first; return, in words, which are followed or not.

    A fact is followed where the data set says what it replaced. Where that says something else, the user who asserted
    it did not know of that.
    """
    by_key = {(row.__tablename__, _key(row)): row for row in rows}
    words: dict[tuple[str, str], str] = {}
    told: dict[tuple[str, str], str | None] = {}  # by the data set
    for fact in facts:
        row = by_key.get((fact.table.name, _key(fact)))
        if row is None:
            continue
        about = str(fact.place), _key(fact)
        now = written(getattr(row, fact.column.name))
        cell = f"{fact.column.name} of {fact.subject.rpartition('/')[2]}"
        by = f"{fact.author} said on {fact.time:%Y-%m-%d}"
        in_data_set = told.setdefault(about, now)
        if now == fact.replaced:
            setattr(row, fact.column.name, value_of(fact.column, fact.value))
            words[about] = f"{cell}: {fact.value}, as {by}; the data set says {in_data_set}"
        elif now != fact.value:
            words[about] = f"{cell}: the data set says {in_data_set} now; what {by} no longer holds"
    return list(words.values())


def _key(of: Base) -> str:
    if isinstance(of, AssertedFact):
        return str(of.row_key)
    return key_text({column.name: getattr(of, column.name) for column in of.__table__.primary_key})


def key_text(key: dict[str, Any]) -> str:
    """Return a row's key as facts write it."""
    return json.dumps({name: str(part) for name, part in sorted(key.items())}, ensure_ascii=False)


def value_of(column: Column[Any], value: str | None) -> Any:
    """Return what a column holds where a fact says this. ValueError where it can hold no such value."""
    return None if value is None else column.type.python_type(value)


def row_of(session: Session, fact: AssertedFact) -> Base | None:
    """Return the row that a fact is about; None where there is none."""
    key = json.loads(str(fact.row_key))
    mapper = next(candidate for candidate in Base.registry.mappers if candidate.local_table is fact.table)
    ident = tuple(value_of(column, key[column.name]) for column in fact.table.primary_key)
    return session.get(mapper.class_, ident)


def is_newer_than_twin(session: Session, robot_id: str, facts: Sequence[AssertedFact]) -> bool:
    """Whether one of the facts is younger than the twin that the robot has."""
    if not facts:
        return False
    older = exists().where(TwinRow.robot_id == robot_id, TwinRow.created < max(fact.time for fact in facts))
    return bool(session.scalar(select(older)))
