"""A real server in a process of its own, on a small workspace."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from tests.endpoint import Server, make_graph, serving


@pytest.fixture(scope="session")
def new_graph(tmp_path_factory: pytest.TempPathFactory) -> Callable[[], Path]:
    """Give a function that makes a workspace's graph: the ontology and two robots."""
    return lambda: make_graph(tmp_path_factory.mktemp("workspace"))


@pytest.fixture(scope="session")
def server(new_graph: Callable[[], Path]) -> Iterator[Server]:
    """A server that nobody writes to."""
    with serving(new_graph(), token=None) as running:
        yield running


@pytest.fixture(scope="session")
def start() -> Callable[..., object]:
    """Give `serving`, for tests that need a server of their own."""
    return serving
