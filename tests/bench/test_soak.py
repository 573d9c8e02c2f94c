"""A short soak of the endpoint; the figures of the long one are in docs/findings/endpoint.md."""

from __future__ import annotations

from pathlib import Path

import pytest
from pyoxigraph import RdfFormat, parse

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from soak import soak

TWO_ROBOTS = Path(__file__).parents[1] / "knowledge/data/two_robots.trig"


@pytest.mark.slow
@pytest.mark.nightly
def test_eight_clients_and_a_writer_meet_no_error_and_leave_nothing_behind(tmp_path: Path) -> None:
    with KnowledgeGraph(tmp_path / "graph") as graph:
        graph.load_ontology()
        graph.replace(parse(path=str(TWO_ROBOTS), format=RdfFormat.TRIG), GRAPH_SOURCE, GRAPH_ACTIVITY)
    outcome = soak(tmp_path, seconds=6, clients=8)
    assert outcome.errors == []
    assert outcome.statuses["200"] > 10
    assert outcome.lags
    assert outcome.growth("server") < 30
    assert max(sample.largest_worker for sample in outcome.samples) < 500
    assert outcome.growth("files") < 20
