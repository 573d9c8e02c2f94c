"""A diagnosis kept in a real PostgreSQL: the same individuals and answers as from SQLite."""

from __future__ import annotations

import json

import pytest
from tests import gap_cases, rows
from tests.gap_pages import graph_of, six_axis

from irtwin.knowledge.questions.queries import ask
from irtwin.providers.gap import record
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.system
FOREMOST = {"attributed": "viscous friction", "ambiguous": "Stribeck friction"}
QUESTIONS = ("why_more_energy", "where_is_the_gap", "what_to_do", "gap_shrinkage", "not_testable", "next_experiment")


def answers(workspace: Workspace) -> dict[str, list[dict[str, object]]]:
    graph = graph_of(workspace)
    return {name: [dict(row) for row in ask(graph, name)] for name in QUESTIONS}


def fill(workspace: Workspace, verdict: str) -> None:
    six_axis(workspace)
    record(workspace, rows.ROBOT, gap_cases.document(verdict), gap_cases.curves(verdict), "{}")


def test_postgresql_answers_as_sqlite_does(tmp_path, new_postgresql_database):
    with (
        Workspace(tmp_path / "sqlite") as sqlite,
        Workspace(tmp_path / "postgresql", new_postgresql_database()) as postgresql,
    ):
        for verdict, first in FOREMOST.items():  # the second replaces the first
            for workspace in (sqlite, postgresql):
                fill(workspace, verdict)
            said = answers(postgresql)
            assert json.dumps(said, default=str) == json.dumps(answers(sqlite), default=str)
            assert next(row["effect"] for row in said["why_more_energy"]) == first
            assert said["what_to_do"]
