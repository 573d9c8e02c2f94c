"""The questions behind a page: SPARQL files, asked of the graph."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from irtwin.input_file import read_text
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.wording import local_name
from irtwin.resources import MOST_BYTES, Resource, Resources

Row = Mapping[str, Any]  # a variable's Python value, None where it is unbound

_HEADER = re.compile(r"^# (title|bind): (.*)\n", re.MULTILINE)


@dataclass(frozen=True)
class PageQuestion:
    """A SPARQL SELECT with its title; `bind` names the variables that must be given an IRI."""

    name: str
    title: str
    bind: tuple[str, ...]
    text: str


@dataclass(frozen=True)
class Answer:
    """A question's rows. `first` is the row of a question that has one answer, or None."""

    question: PageQuestion
    rows: tuple[Row, ...]

    @property
    def first(self) -> Row | None:
        """The first row, None where there is none."""
        return self.rows[0] if self.rows else None


Answers = Mapping[str, Answer]


def questions_of(resources: Resources, report: str) -> dict[str, PageQuestion]:
    """Return the questions of a report, by file stem."""
    return read_questions(file.path for file in _files(resources, report))


def added_to(resources: Resources, report: str) -> list[str]:
    """Return the names of a report's questions that do not ship, so that its page has no place of theirs."""
    return [file.path.stem for file in _files(resources, report) if file.is_extension and not file.replaces]


def _files(resources: Resources, report: str) -> list[Resource]:
    return [file for file in resources.of("reports", ".rq") if file.name.startswith(f"{report}/")]


def read_questions(files: Iterable[Path]) -> dict[str, PageQuestion]:
    """Read questions, by file stem. Raises InputError where one is not UTF-8."""
    return {file.stem: _parse(file) for file in files}


def ask(graph: KnowledgeGraph, questions: Mapping[str, PageQuestion], bindings: Mapping[str, str]) -> dict[str, Answer]:
    """Ask every question; one whose variables are not all in `bindings` has no rows."""
    return {name: Answer(question, _rows(graph, question, bindings)) for name, question in questions.items()}


def limits(answers: Answers) -> dict[str, float]:
    """Return the limits of the graph, which the question `limits` finds, by the ends of their IRIs.

    Each is in the unit that the ontology gives it; no page has a limit of its own.
    """
    return {local_name(row["limit"]): float(row["value"]) for row in answers["limits"].rows}


def effect_name(row: Row, variable: str = "effect") -> str:
    """Return what the ontology calls a row's effect, `label`, or its id; of another variable, `variable_label`."""
    label = row["label" if variable == "effect" else f"{variable}_label"]
    return str(label or local_name(row[variable]).replace("_", " "))


def _parse(file: Path) -> PageQuestion:
    text = read_text(file, MOST_BYTES)
    header = dict(_HEADER.findall(text))
    bind = tuple(name.strip() for name in header.get("bind", "").split(",") if name.strip())
    return PageQuestion(file.stem, header["title"], bind, _HEADER.sub("", text).strip())


def _rows(graph: KnowledgeGraph, question: PageQuestion, bindings: Mapping[str, str]) -> tuple[Row, ...]:
    if not set(question.bind) <= set(bindings):
        return ()
    return tuple(graph.query(question.text, {name: bindings[name] for name in question.bind}))
