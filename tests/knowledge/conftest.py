from pathlib import Path

import pytest
from pyoxigraph import Quad, RdfFormat, parse
from tests.knowledge.graphs import graph_of, reasoned_over

from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph

DATA = Path(__file__).parent / "data"


@pytest.fixture(scope="session")
def two_robots() -> list[Quad]:
    return list(parse(path=str(DATA / "two_robots.trig"), format=RdfFormat.TRIG))


@pytest.fixture
def graph(two_robots: list[Quad]) -> KnowledgeGraph:
    """The ontology and two robots, nothing inferred yet."""
    return graph_of(two_robots)


@pytest.fixture(scope="session")
def reasoned(two_robots: list[Quad]) -> KnowledgeGraph:
    """The ontology, two robots and what is inferred of them, which no test changes."""
    return reasoned_over(two_robots)


@pytest.fixture(scope="session")
def concluded(two_robots: list[Quad]) -> KnowledgeGraph:
    """The ontology, two robots and all that is concluded of them, which no test changes."""
    graph = reasoned_over(two_robots)
    validate(graph)
    return graph
