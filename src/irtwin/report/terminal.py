"""Answers as tables in the terminal."""

from __future__ import annotations

from collections.abc import Sequence
from datetime import datetime
from typing import Any

from rich.cells import cell_len
from rich.console import Console
from rich.table import Table
from rich.text import Text

from irtwin.knowledge.store import table as answers

_LEAST = 6  # characters that a column of text keeps
_BETWEEN = 3  # characters between two columns


def show(answer: answers.AnswerTable, in_sections: bool = False, counted: bool = True) -> None:
    """Print an answer as a table, numbers to the right and never broken; `in_sections`, each named by the first column.

    Text is folded where the terminal is narrow. Where that is not enough, each row is printed as a block of lines.
    `counted`: the number of rows stands below.
    """
    console = Console()
    rows = [[_text(row[column]) for column in answer.columns] for row in answer]
    numbers = [any(isinstance(row[column], int | float) for row in answer) for column in answer.columns]
    # a pipe has no width: it gets what the table needs
    widths = _widths(answer.columns, rows, numbers, console.width if console.is_terminal else None)
    if widths is None:
        _print_blocks(console, answer.columns, rows)
    else:
        table = Table(header_style="bold", show_edge=False, pad_edge=False)
        for column, width, right in zip(answer.columns, widths, numbers, strict=True):
            table.add_column(Text(column), justify="right" if right else "left", overflow="fold", width=width)
        section = None
        for first, *others in rows:
            if in_sections and section not in (None, first):
                table.add_section()
            table.add_row(Text("" if in_sections and first == section else first), *map(Text, others))
            section = first
        if not console.is_terminal:
            console.width = sum(widths) + _BETWEEN * len(widths)
        console.print(table)
    if counted:
        console.print(f"{len(rows)} row{'' if len(rows) == 1 else 's'}", style="dim", highlight=False)


def _widths(
    columns: Sequence[str], rows: Sequence[Sequence[str]], numbers: Sequence[bool], room: int | None
) -> list[int] | None:
    """Return the width of each column, so that all fit into `room` and no number is broken; None where they cannot."""
    contents = [max((cell_len(row[place]) for row in rows), default=0) for place in range(len(columns))]
    widths = [max(cell_len(column), width) for column, width in zip(columns, contents, strict=True)]
    if room is None:
        return widths
    least = [
        max(width, 1) if number else min(widest, _LEAST)
        for width, widest, number in zip(contents, widths, numbers, strict=True)
    ]
    room -= _BETWEEN * (len(columns) - 1)
    if sum(least) > room:
        return None
    while sum(widths) > room:
        spare = [width - few for width, few in zip(widths, least, strict=True)]
        widths[max(range(len(widths)), key=lambda place: (spare[place] > 0, widths[place]))] -= 1
    return widths


def _print_blocks(console: Console, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    longest = max(map(cell_len, columns), default=0)
    for place, row in enumerate(rows):
        if place:
            console.print()
        for column, cell in zip(columns, row, strict=True):
            label = Text(column + " " * (longest - cell_len(column) + 2), style="bold")
            console.print(
                label.append(cell, style="not bold"), soft_wrap=True
            )  # the terminal itself folds what is long


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, datetime):
        return value.isoformat(sep=" ", timespec="seconds")
    return str(value)
