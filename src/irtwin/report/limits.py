"""The limits of the graph, by the ends of their IRIs: no page has one of its own."""

from __future__ import annotations

from irtwin.report import wording
from irtwin.report.questions import Answers


def limits(answers: Answers) -> dict[str, float]:
    """Return the values of what the question `limits` found, each in the unit that the ontology gives it."""
    return {wording.local_name(row["limit"]): float(row["value"]) for row in answers["limits"].rows}
