"""Soaks: a short one of the endpoint, a long one of robots that are watched beside it; figures are in docs/findings."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from pyoxigraph import RdfFormat, parse

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from live_soak import Outcome
from live_soak import soak as soak_live
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


@pytest.mark.slow
@pytest.mark.nightly
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("on_server", [False, True])
def test_robots_that_are_watched_for_ten_minutes_beside_clients_take_no_more_memory(
    on_server: bool, tmp_path: Path
) -> None:
    outcome = soak_live(tmp_path, seconds=600, robots=20, rate=50, on_server=on_server)
    assert outcome.errors == []
    assert outcome.stored == outcome.sent == 600 * 20 * 50
    assert outcome.events > 0 and outcome.statuses["200"] > 100
    assert outcome.grown() == [], outcome.report()


def test_memory_is_flat_within_its_noise_after_the_warm_up() -> None:
    noise = np.random.default_rng(1).normal(0.0, 1.0, 300)
    at = 2.0 * np.arange(300)
    held = {
        "warm": 200.0 + 100.0 * np.minimum(at / 100.0, 1.0) + noise,
        "leak": 200.0 + at / 60.0 * 2.0 + noise,  # 2 MB a minute
        "brief": 200.0 + 10.0 * at,
    }
    outcome = Outcome(memory={name: list(zip(at, of, strict=True)) for name, of in held.items()}, store_in="leak")
    outcome.memory["brief"] = outcome.memory["brief"][:5]
    assert outcome.grown() == []  # it may be the store's cache
    outcome.store_in = "live"
    assert outcome.grown() == ["leak"]
    assert outcome.growth("leak")[0] == pytest.approx(2.0 * 8, abs=1.0)
    assert "grew by more than is allowed: leak" in outcome.report()
