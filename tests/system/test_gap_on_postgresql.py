"""A diagnosis kept in a real PostgreSQL: the same individuals and answers as from SQLite."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from tests import gap_cases, rows
from tests.gap_pages import six_axis

from irtwin.knowledge.mapping import map_database
from irtwin.knowledge.questions.queries import ask
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from irtwin.providers.gap import record
from irtwin.resources import folder
from irtwin.storage.database import Workspace

pytestmark = pytest.mark.system
FOREMOST = {"attributed": "viscous friction", "ambiguous": "Stribeck friction"}
QUESTIONS = ("why_more_energy", "where_is_the_gap", "what_to_do", "gap_shrinkage", "not_testable", "next_experiment")
MAPPINGS = sorted(Path(folder("mappings")).glob("*.r2rml.ttl"))


def answers(workspace: Workspace) -> dict[str, list[dict[str, object]]]:
    graph = KnowledgeGraph()
    graph.load_ontology()
    graph.replace(map_database(workspace.engine, MAPPINGS), GRAPH_SOURCE, GRAPH_ACTIVITY)
    reason(graph)
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
