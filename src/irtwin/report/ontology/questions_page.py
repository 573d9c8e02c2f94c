"""The competency questions of the ontology: one HTML page of what the graph can be asked by name, by whom, and how."""

from __future__ import annotations

from pathlib import Path

from irtwin.knowledge.questions.queries import THEMES, columns_of, named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.page import content_policy
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


def write_page(out: Path, known: Resources | None = None, graph: KnowledgeGraph | None = None) -> None:
    """Write the page of the questions that are `known`, or else ship, with answers of a graph if one is given.

    Raises InputError where it cannot.
    """
    check_place(out)
    write(out, page(known or shipped(), graph).encode())


def page(known: Resources, graph: KnowledgeGraph | None = None) -> str:
    """Return the page: the questions, each with the variables that it selects, and a graph's answer if one is given."""
    questions = [
        (question, columns_of(question.text), () if graph is None else graph.query(question.text))
        for question in named_questions(known).values()
    ]
    return (
        environment(shipped())
        .get_template("ontology/questions.html.jinja")
        .render(
            themes={theme: [one for one in questions if one[0].theme == theme] for theme in THEMES},
            asked_by=ASKED_BY,
            count=len(questions),
            answered=graph is not None,
            most_rows=MOST_ROWS,
            policy=content_policy([]),
            style=style(shipped(), "layout/style.css", "ontology/style.css"),
        )
    )
