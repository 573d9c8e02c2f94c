"""Effects that are installed and effects that the ontology describes are the same, or nothing is concluded."""

from __future__ import annotations

from pathlib import Path

import pytest
from sqlalchemy import select
from tests import small_robots
from tests.mapped import ontology_graph

from irtwin import workflow
from irtwin.errors import InputError
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.providers.effects_of_ontology import check_effects
from irtwin.storage import schema
from irtwin.storage.database import Workspace


@pytest.fixture
def graph() -> KnowledgeGraph:
    return ontology_graph()


def test_those_that_ship_are_the_same(graph: KnowledgeGraph) -> None:
    check_effects(graph)


def test_one_that_the_ontology_lacks_is_told(graph: KnowledgeGraph) -> None:
    graph.update("DELETE WHERE { <https://w3id.org/irtwin/effect/copper_loss> ?p ?o }")
    with pytest.raises(InputError, match=r'lacks the effect "copper_loss", .*ontology/copper_loss\.ttl'):
        check_effects(graph)


def test_one_that_is_not_installed_is_told(graph: KnowledgeGraph) -> None:
    other = "<https://w3id.org/irtwin/effect/magic>"
    graph.update(f"INSERT DATA {{ {other} a irt:Effect ; rdfs:label 'magic' ; irt:has_Channel irt:x }}")
    with pytest.raises(InputError, match=r'describes the effect "magic", which is not installed'):
        check_effects(graph)


def test_nothing_is_stored_of_a_run_whose_effects_are_not_described(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    known = workflow.check_effects.__globals__["catalogue"]()
    monkeypatch.setattr("irtwin.providers.effects_of_ontology.catalogue", lambda: known | {"magic": None})
    data = small_robots.data_set(tmp_path / "data", "arm")
    with pytest.raises(InputError, match='lacks the effect "magic"'):
        workflow.run(data, tmp_path / "workspace")
    with Workspace(tmp_path / "workspace") as place, place.reading() as session:
        assert session.scalars(select(schema.RunRow)).all() == []
