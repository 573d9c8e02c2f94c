from pathlib import Path

import pytest
from pyoxigraph import Quad, RdfFormat, parse

from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE

DATA = Path(__file__).parent / "data"


@pytest.fixture(scope="session")
def two_robots() -> list[Quad]:
    return list(parse(path=str(DATA / "two_robots.trig"), format=RdfFormat.TRIG))


@pytest.fixture
def graph(two_robots: list[Quad]) -> KnowledgeGraph:
    """The ontology and two robots, nothing inferred yet."""
    graph = KnowledgeGraph()
    graph.load_ontology()
    graph.replace(two_robots, GRAPH_SOURCE, GRAPH_ACTIVITY)
    return graph


@pytest.fixture(scope="session")
def concluded(two_robots: list[Quad]) -> KnowledgeGraph:
    """The ontology, two robots and all that is concluded of them, which no test changes."""
    graph = KnowledgeGraph()
    graph.load_ontology()
    graph.replace(two_robots, GRAPH_SOURCE, GRAPH_ACTIVITY)
    reason(graph)
    validate(graph)
    return graph
