"""Answers as tables in the terminal."""

from __future__ import annotations

from datetime import datetime
from typing import Any

from rich.console import Console
from rich.table import Table
from rich.text import Text

from irtwin.knowledge.store import table as answers


def show(answer: answers.Table, in_sections: bool = False) -> None:
    """Print an answer as a table, numbers to the right; `in_sections`, each named once by the first column."""
    table = Table(header_style="bold")
    for column in answer.columns:
        numbers = any(isinstance(row[column], int | float) for row in answer)
        table.add_column(Text(column), justify="right" if numbers else "left", overflow="fold")
    section = None
    for row in answer:
        first, *others = (_text(row[column]) for column in answer.columns)
        if in_sections and section not in (None, first):
            table.add_section()
        table.add_row(Text("" if in_sections and first == section else first), *map(Text, others))
        section = first
    console = Console()
    # a pipe has no width: give it what the table needs, so that nothing is folded
    console.print(table, width=None if console.is_terminal else 10_000, no_wrap=not console.is_terminal)
    console.print(f"{len(answer)} row{'' if len(answer) == 1 else 's'}", style="dim", highlight=False)


def _text(value: Any) -> str:
    if value is None:
        return ""
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, datetime):
        return value.isoformat(sep=" ", timespec="seconds")
    return str(value)
