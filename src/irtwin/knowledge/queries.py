"""Questions to the graph: those that have a name, and any other in SPARQL."""

from __future__ import annotations

import csv
import io
import json
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from difflib import get_close_matches
from functools import cache
from pathlib import Path
from typing import Any

from irtwin.errors import InputError
from irtwin.knowledge.graph import KnowledgeGraph
from irtwin.knowledge.table import Table

_FOLDER = Path(__file__).parent / "questions"
_HEADER = re.compile(r"^# (title|question): (.+)$", re.MULTILINE)
_QUERY_FORM = re.compile(r"\b(select|ask|construct|describe|prefix|base|insert|delete)\b", re.IGNORECASE)


@dataclass(frozen=True)
class Question:
    """A named SPARQL query; `question` is what it answers, in words."""

    name: str
    title: str
    question: str
    text: str


@cache
def named_questions() -> Mapping[str, Question]:
    """Return the questions that have a name, in the order of their names."""
    return {file.stem: _read(file) for file in sorted(_FOLDER.glob("*.rq"))}


def ask(graph: KnowledgeGraph, question: str) -> Table:
    """Answer a named question, or one in SPARQL."""
    return graph.query(_text(question))


def to_json(table: Table) -> str:
    """Write the rows as a JSON array of objects; what is unbound or not finite is null."""
    rows = [{name: _plain(value) for name, value in row.items()} for row in table]
    return json.dumps(rows, indent=2, ensure_ascii=False, allow_nan=False)


def to_csv(table: Table) -> str:
    """Write the rows as CSV with a header (RFC 4180); what is unbound is empty."""
    out = io.StringIO()
    writer = csv.writer(out)
    writer.writerow(table.columns)
    writer.writerows(
        [row[name].isoformat() if isinstance(row[name], date) else row[name] for name in table.columns] for row in table
    )
    return out.getvalue()


def _plain(value: Any) -> Any:
    if isinstance(value, date):
        return value.isoformat()
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _read(file: Path) -> Question:
    text = file.read_text(encoding="utf-8")
    header = dict(_HEADER.findall(text))
    return Question(file.stem, header["title"], header["question"], text)


def _text(question: str) -> str:
    known = named_questions()
    if question in known:
        return known[question].text
    if _QUERY_FORM.search(question):
        return question
    near = get_close_matches(question, known, n=1)
    hint = f"did you mean {near[0]}?" if near else f"known are {', '.join(known)}"
    raise InputError(f"no question is called {question!r}: {hint}")
