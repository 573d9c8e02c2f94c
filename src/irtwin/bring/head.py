"""Where in the first rows of a table the names stand, the units, and the first sample."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from irtwin.signals.unit import QUANTITIES, unit_of

LOOKED_AT = 60  # rows that tell it
MISSING = ("", "nan", "-nan", "na", "n/a", "#n/a", "null", "none", "-")  # in small letters: nothing was measured
DATE = re.compile(r"\d{4}-\d{2}-\d{2}|\d{1,2}\.\d{1,2}\.\d{4}")
CLOCK = re.compile(r"\d{1,2}:\d{2}(:\d{2}([.,]\d*)?)?")
_NUMBER = re.compile(r"[+-]?(\d+([.,]\d*)?|[.,]\d+)([eE][+-]?\d+)?")


@dataclass(frozen=True)
class Head:
    """Rows from 0; None where there is none of that kind."""

    names: int | None
    units: int | None
    first: int  # sample

    def names_in(self, rows: Sequence[Sequence[str]]) -> list[str]:
        """Return the columns' names, column_1, column_2, ... where there are none."""
        cells = rows[self.first] if self.names is None else rows[self.names]
        named = [cell.strip().lstrip("#").strip() if self.names is not None else "" for cell in cells]
        return [name or f"column_{number}" for number, name in enumerate(named, start=1)]

    def units_in(self, rows: Sequence[Sequence[str]]) -> list[str]:
        """Return what the row of units says of each column, "" where it says nothing."""
        return [""] * len(rows[self.first]) if self.units is None else [_unit_text(cell) for cell in rows[self.units]]


def head_of(rows: Sequence[Sequence[str]]) -> Head | None:
    """Return the head of a table: samples begin with the first row of numbers that is as long as most rows are.

    None where no row of two cells or more is one.
    """
    width = Counter(len(row) for row in rows).most_common(1)[0][0] if rows else 0
    first = next((number for number, row in enumerate(rows) if len(row) == width and _is_sample(row)), None)
    if width < 2 or first is None:
        return None
    above = [number for number in range(first) if len(rows[number]) == width]
    units = above[-1] if len(above) > 1 and _are_units(rows[above[-1]]) else None
    names = [number for number in above if number != units]
    return Head(names[-1] if names else None, units, first)


def numbers_in(cells: Sequence[str]) -> int:
    """Return how many cells are numbers."""
    return sum(bool(_NUMBER.fullmatch(cell.strip())) for cell in cells)


def _is_sample(cells: Sequence[str]) -> bool:
    """Whether a row holds numbers, in half of it at least beside date and clock: texts may stand beside them."""
    numbers = numbers_in(cells)
    blank = sum(cell.strip().lower() in MISSING for cell in cells)
    times = sum(bool(DATE.fullmatch(cell.strip()) or CLOCK.fullmatch(cell.strip())) for cell in cells)
    return numbers > 0 and 2 * (numbers + blank) >= len(cells) - times


def _are_units(cells: Sequence[str]) -> bool:
    known = [text for cell in cells if (text := _unit_text(cell))]
    return bool(known) and sum(unit_of(text, QUANTITIES) is not None for text in known) * 2 > len(known)


def _unit_text(cell: str) -> str:
    return cell.strip(" []()")
