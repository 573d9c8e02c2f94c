"""A graph with robots, and pages made of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.report.robots import Factory, PageOf, answers, six_axis

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.energy.page import render
from irtwin.report.questions import Answers


@pytest.fixture
def graph() -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.load_ontology()
    return graph


@pytest.fixture(scope="session")
def six_answers() -> Answers:
    """What the questions say of a robot of six axes."""
    graph = KnowledgeGraph()
    graph.load_ontology()
    return answers(graph, six_axis(graph))


@pytest.fixture
def page_of(graph: KnowledgeGraph, tmp_path: Path) -> PageOf:
    """Return a function that renders the page of a robot in the graph, as text."""

    def page(factory: Factory) -> str:
        out = tmp_path / "reports" / f"{factory.robot_id}.html"
        render(graph, factory.iri, factory.read_series, out)
        return out.read_text(encoding="utf-8")

    return page


@pytest.fixture(scope="session")
def plant(plant_place: Path) -> KnowledgeGraph:
    """A graph of four robots, for the pages of a plant."""
    return KnowledgeGraph(plant_place / "graph", read_only=True)
