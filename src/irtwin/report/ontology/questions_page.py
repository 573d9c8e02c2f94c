"""The competency questions of the ontology: one HTML page of what the graph can be asked by name, by whom, and how."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from irtwin.knowledge.questions.queries import THEMES, NamedQuery, columns_of, named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.page import content_policy
from irtwin.report.questions import Row
from irtwin.report.templates import environment, style
from irtwin.resources import Resources, shipped
from irtwin.storage.files import check_place, write

MOST_ROWS = 3  # of a sample answer
ASKED_BY = {
    "robot": "whoever commissions or looks after the robot",
    "run": "whoever plans what the robot does",
    "joint": "maintenance",
    "energy": "whoever answers for the plant's energy",
    "ledger": "drive and mechanical engineers",
    "twin": "whoever models the robot",
    "gap": "whoever models the robot, and maintenance",
    "provenance": "auditors, and whoever doubts a number",
    "fleet": "whoever runs the plant",
}


@dataclass(frozen=True)
class Competency:
    """A named question as the page shows it: the variables that it selects, and a graph's answer."""

    asked: NamedQuery
    columns: Sequence[str]
    answer: Sequence[Row] = ()


def write_page(out: Path, known: Resources | None = None, graph: KnowledgeGraph | None = None) -> None:
    """Write the page of the questions that are `known`, or else ship, with answers of a graph if one is given.

    Raises InputError where it cannot.
    """
    check_place(out)
    write(out, page(known or shipped(), graph).encode())


def page(known: Resources, graph: KnowledgeGraph | None = None) -> str:
    """Return the page."""
    competencies_found = list(competencies(known, graph))
    return (
        environment(shipped())
        .get_template("ontology/questions.html.jinja")
        .render(
            themes={
                theme: [competency for competency in competencies_found if competency.asked.theme == theme]
                for theme in THEMES
            },
            asked_by=ASKED_BY,
            count=len(competencies_found),
            answered=graph is not None,
            most_rows=MOST_ROWS,
            policy=content_policy([]),
            style=style(shipped(), "layout/style.css", "ontology/style.css"),
        )
    )


def competencies(known: Resources, graph: KnowledgeGraph | None = None) -> Iterator[Competency]:
    """Yield the questions, theme by theme, each with what a graph answers if one is given."""
    for question in named_questions(known).values():
        yield Competency(question, columns_of(question.text), () if graph is None else graph.query(question.text))
