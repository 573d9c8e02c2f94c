"""A graph with robots, and pages made of it."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests import plants
from tests.report.robots import Factory, PageOf

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.report.energy.page import render

TARIFF = 'price_per_kwh = 0.2\ncurrency = "EUR"\nco2_kg_per_kwh = 0.4\nhours_a_year = 1000\n'


@pytest.fixture
def graph() -> KnowledgeGraph:
    graph = KnowledgeGraph()
    graph.load_ontology()
    return graph


@pytest.fixture
def page_of(graph: KnowledgeGraph, tmp_path: Path) -> PageOf:
    """Return a function that renders the page of a robot in the graph, as text."""

    def page(factory: Factory) -> str:
        out = tmp_path / "reports" / f"{factory.robot_id}.html"
        render(graph, factory.iri, factory.read_series, out)
        return out.read_text(encoding="utf-8")

    return page


@pytest.fixture(scope="session")
def plant(tmp_path_factory: pytest.TempPathFactory) -> KnowledgeGraph:
    """A graph of four robots, for the pages of a plant."""
    place = tmp_path_factory.mktemp("plant")
    (place / "plant.toml").write_text(TARIFF, encoding="utf-8")
    graph = KnowledgeGraph(workspace=place)
    plants.fill(graph, place)
    return graph
