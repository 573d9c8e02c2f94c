"""The rows of a diagnosis, from its document as the document tells them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from irtwin.document.curves import Curves
from irtwin.document.document import Document
from irtwin.document.tables import DOCUMENT, OF_CURVES, Column, Table, reached
from irtwin.document.words import UNITS
from irtwin.errors import InputError
from irtwin.providers.names import identifier
from irtwin.storage.gap_schema import CLASSES, OfDiagnosis
from irtwin.storage.rows import Values


@dataclass(frozen=True)
class Of:
    """What the rows of a diagnosis belong to; `runs` by their identifiers, `joints` of the robot with their kinds."""

    diagnosis_id: str
    robot_id: str
    runs: Mapping[str, str]
    joints: Mapping[str, str]

    def run_id(self, name: str) -> str:
        """Return the run_id of a run, by its name in the document. Raises InputError where it is not there."""
        if identifier(name) not in self.runs:
            raise InputError(
                f'run "{name}" of the diagnosis is not in the workspace; run `irtwin run` on its data set first'
            )
        return self.runs[identifier(name)]

    def unit(self, word: str, joint: str | None) -> str:
        """Return the unit of what a word says, of the whole robot or at a joint."""
        slides = joint is not None and self.joints[joint] == "prismatic"
        return UNITS[word].replace("N m", "N").replace("rad", "m") if slides else UNITS[word]


def row(document: Document, of: Of) -> Values:
    """Return the columns of a diagnosis that its document tells."""
    return _row(DOCUMENT, None, document, of)


def rows(document: Document, drawn: Curves, of: Of) -> Iterator[OfDiagnosis]:
    """Yield all further rows of a diagnosis. Raises InputError where it names a joint or a run that is not there."""
    for whole, tables in ((document, DOCUMENT.parts), (drawn, OF_CURVES)):
        for table in tables:
            yield from _rows(table, whole, {"diagnosis_id": of.diagnosis_id}, of)


def _rows(table: Table, whole: Any, key: Values, of: Of) -> Iterator[OfDiagnosis]:
    for place, part in _placed(table, reached(whole, table.steps)):
        made = key | _row(table, place, part, of)
        yield CLASSES[table.name](**made)
        for inner in table.parts:
            yield from _rows(inner, part, {name: made[name] for name in table.keys}, of)


def _placed(table: Table, parts: Any) -> Iterator[tuple[str | int, Any]]:
    """Yield parts with the place that each has: its key, its number from 1, or the name itself, once."""
    if isinstance(parts, Mapping):
        yield from parts.items()
    elif table.individual is None:
        yield from ((name, None) for name in dict.fromkeys(parts or ()))
    else:
        yield from enumerate(parts if isinstance(parts, tuple) else filter(None, (parts,)), start=1)


def _row(table: Table, place: str | int | None, part: Any, of: Of) -> Values:
    made = {column.name: _value(column, place, part, of) for column in table.columns if not column.unit_of}
    joint = made.get("joint")
    if joint is not None and joint not in of.joints:
        raise InputError(f"{of.robot_id} has no joint {joint}; diagnose a data set of this robot")
    made |= {column.name: of.unit(made[column.unit_of], joint) for column in table.columns if column.unit_of}
    return made | ({"robot_id": of.robot_id} if table.of_robot else {})


def _value(column: Column, place: str | int | None, part: Any, of: Of) -> Any:
    value = place if column.is_place else reached(part, column.steps)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return of.run_id(str(value)) if column.name == "run_id" else value
