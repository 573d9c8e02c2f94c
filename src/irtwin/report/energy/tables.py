"""Tables of a page that turn or group the rows of their questions."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

from irtwin.knowledge.explain.explanation import Explanation
from irtwin.report import wording
from irtwin.report.questions import Row, effect_name

Explain = Callable[[str, str, str], Explanation | None]  # subject, predicate and object, by their IRIs


@dataclass(frozen=True)
class ParameterCell:
    """A parameter's value and 95 % interval as text; `unsure` where it is known to no better than half its value.

    scaled: the interval that holds the scale of torque, too, where that is to be seen.
    """

    value: str
    interval: str | None
    unsure: bool
    scaled: str | None = None


@dataclass(frozen=True)
class ParameterLine:
    """A parameter of one effect: `cells` by joint, or the one `cell` of a parameter of no joint."""

    label: str
    name: str
    unit: str | None
    cells: dict[str, ParameterCell]
    cell: ParameterCell | None = None


@dataclass(frozen=True)
class Parameters:
    """Parameters of joints, one line each; the others as (effect's label, lines)."""

    joints: tuple[str, ...]
    per_joint: tuple[ParameterLine, ...]
    others: tuple[tuple[str, tuple[ParameterLine, ...]], ...]


# A rigid body's parameters are many, and few people read them one by one: they stay a list.
_MATRIX_NAMES = 4


def parameters(rows: Sequence[Row], joints: Sequence[Row]) -> Parameters:
    """Arrange a twin's parameters: one line for each that joints have, lists for the rest."""
    per_joint: list[ParameterLine] = []
    others: list[tuple[str, tuple[ParameterLine, ...]]] = []
    for _, group in groupby(rows, key=lambda row: row["effect"]):
        of_effect = list(group)
        names = {row["name"] for row in of_effect}
        if all(row["joint"] for row in of_effect) and len(names) <= _MATRIX_NAMES:
            per_joint += [_line([row for row in of_effect if row["name"] == name]) for name in sorted(names)]
        else:
            in_order = sorted(of_effect, key=lambda row: _natural(row["name"]))
            others.append((effect_name(of_effect[0]), tuple(_single(row) for row in in_order)))
    return Parameters(tuple(row["joint"] for row in joints), tuple(per_joint), tuple(others))


def conclusions(rows: Sequence[Row], explain: Explain | None = None) -> list[Row]:
    """Gather the individuals about which the same was concluded, and who concluded it.

    `explain` says of the first of them how it is `known`.
    """
    gathered: list[Row] = []
    for iri, group in groupby(rows, key=lambda row: row["conclusion"]):
        members = list(group)
        first, fact = members[0], [members[0][name] for name in ("about", "property", "object")]
        gathered.append({
            "label": first["label"] or wording.local_name(iri).replace("_", " "),
            "definition": first["definition"],
            "about": list(dict.fromkeys(map(_about, members))),
            "by": list(dict.fromkeys(_reasoner(row["concluded_by"]) for row in members)),
            "known": None if explain is None or first["object"] is None else explain(*fact),
        })  # fmt: skip
    return gathered


def _about(row: Row) -> str:
    name = row["about_name"] or wording.local_name(row["about"])
    return f"{name}: {row['value']}" if row["value"] else str(name)


def _reasoner(graph: str) -> str:
    kind = graph.partition("/")[0]
    return {"owl_rl": "OWL 2 RL reasoning", "swrl": "SWRL rules", "shacl": "SHACL rules"}.get(kind, kind)


def _natural(name: str) -> list[str | int]:
    """Return a sorting key by which base_2 comes before base_10."""
    return [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", name)]


def _line(rows: Sequence[Row]) -> ParameterLine:
    first = rows[0]
    return ParameterLine(effect_name(first), first["name"], first["unit"], {row["joint"]: _cell(row) for row in rows})


def _single(row: Row) -> ParameterLine:
    name = f"{row['name']} of {row['joint']}" if row["joint"] else row["name"]
    return ParameterLine(effect_name(row), name, row["unit"], {}, _cell(row))


def _cell(row: Row) -> ParameterCell:
    lower: Any = row["lower"]
    upper: Any = row["upper"]
    if lower is None or upper is None:
        return ParameterCell(wording.number(row["value"]), None, True)
    value, interval = wording.interval(row["value"], lower, upper)
    scaled = scaled_interval(row)
    return ParameterCell(value, interval, is_unsure(row["value"], lower, upper), None if scaled == interval else scaled)


def scaled_interval(row: Row) -> str | None:
    """Return a parameter's interval with the scale of torque in it as text; None where it does not go with that."""
    lower: Any = row["scaled_lower"]
    upper: Any = row["scaled_upper"]
    return None if lower is None or upper is None else wording.interval(row["value"], lower, upper)[1]


def is_unsure(value: float, lower: float | None, upper: float | None) -> bool:
    """Return whether a number is known to no better than half of it, or its interval not at all."""
    if lower is None or upper is None or not math.isfinite(upper - lower):
        return True
    return upper - lower >= abs(value)
