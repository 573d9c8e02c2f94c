"""The questions behind a page: SPARQL files, asked of the graph."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

Row = Mapping[str, Any]  # a variable's Python value, None where it is unbound

_HEADER = re.compile(r"^# (title|bind): (.*)\n", re.MULTILINE)


class Graph(Protocol):
    """What a page needs of a knowledge graph."""

    def query(self, text: str, bindings: Mapping[str, str] = ...) -> Sequence[Row]:
        """Answer a SELECT over the union of all named graphs; `bindings` maps variables to IRIs."""


@dataclass(frozen=True)
class Question:
    """A SPARQL SELECT with its title; `bind` names the variables that must be given an IRI."""

    name: str
    title: str
    bind: tuple[str, ...]
    text: str


@dataclass(frozen=True)
class Answer:
    """A question's rows. `first` is the row of a question that has one answer, or None."""

    question: Question
    rows: tuple[Row, ...]

    @property
    def first(self) -> Row | None:
        """The first row, None where there is none."""
        return self.rows[0] if self.rows else None


Answers = Mapping[str, Answer]


def read_questions(folder: Path) -> dict[str, Question]:
    """Read every `*.rq` of a report's folder, by file stem."""
    return {file.stem: _parse(file) for file in sorted(folder.glob("*.rq"))}


def ask(graph: Graph, questions: Mapping[str, Question], bindings: Mapping[str, str]) -> dict[str, Answer]:
    """Ask every question; one whose variables are not all in `bindings` has no rows."""
    return {name: Answer(question, _rows(graph, question, bindings)) for name, question in questions.items()}


def _parse(file: Path) -> Question:
    text = file.read_text(encoding="utf-8")
    header = dict(_HEADER.findall(text))
    bind = tuple(name.strip() for name in header.get("bind", "").split(",") if name.strip())
    return Question(file.stem, header["title"], bind, _HEADER.sub("", text).strip())


def _rows(graph: Graph, question: Question, bindings: Mapping[str, str]) -> tuple[Row, ...]:
    if not set(question.bind) <= set(bindings):
        return ()
    return tuple(graph.query(question.text, {name: bindings[name] for name in question.bind}))
