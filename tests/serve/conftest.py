"""A real server in a process of its own, on a small workspace."""

from __future__ import annotations

import shutil
from collections.abc import AsyncIterator, Callable, Iterator
from contextlib import asynccontextmanager
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tests.conftest import MadeOnce
from tests.endpoint import Server, make_graph, serving

from irtwin.location import Location
from irtwin.serve.pool import Limits, Pool


@pytest.fixture(scope="session")
def new_graph(made_once: MadeOnce, tmp_path_factory: pytest.TempPathFactory) -> Callable[[], Path]:
    """Give a function that makes a workspace's graph: the ontology and two robots."""
    made = made_once("two_robots", make_graph)
    return lambda: Path(shutil.copytree(made, tmp_path_factory.mktemp("workspace"), dirs_exist_ok=True)) / "graph"


@pytest.fixture(scope="session")
def server(new_graph: Callable[[], Path]) -> Iterator[Server]:
    """A server that nobody writes to."""
    with serving(new_graph(), token=None) as running:
        yield running


@pytest.fixture(scope="module")
def writable(new_graph: Callable[[], Path]) -> Iterator[Server]:
    """A server that who has the token may write to."""
    with serving(new_graph()) as running:
        yield running


@pytest.fixture(scope="module")
def strict(new_graph: Callable[[], Path]) -> Iterator[Server]:
    """A server that gives a query two seconds."""
    with serving(new_graph(), "--timeout", 2) as running:
        yield running


@pytest.fixture
def anyio_backend() -> str:
    """What tests that are coroutines run on."""
    return "asyncio"


@asynccontextmanager
async def pool(graph: Path, limits: Limits) -> AsyncIterator[Pool]:
    """One worker on a graph, until the block ends."""
    workers = Pool(Location(graph.parent), 1, limits)
    await workers.open()
    try:
        yield workers
    finally:
        await workers.close()


@pytest.fixture(scope="session")
def plant(plant_place: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    """A server of four robots, one of them with a hostile name, a tariff and reports."""
    folder = Path(shutil.copytree(plant_place, tmp_path_factory.mktemp("plant"), dirs_exist_ok=True))
    for run in ("fit_1", "check_1"):
        write_samples(folder / "series" / f"Arm_A.{run}")
    (folder / "reports").mkdir()
    (folder / "reports/Arm_A.html").write_text(REPORT, encoding="utf-8")
    (folder / "reports/Arm_A.gap.html").write_text(REPORT, encoding="utf-8")
    (folder / "reports/out.html").symlink_to("/etc/hostname")
    with serving(folder / "graph", token=None) as running:
        yield running


def write_samples(path: Path) -> None:
    """Write a run's samples, more than a curve holds: they begin at 5 s, and power has a peak of 900 W at 12.345 s."""
    time = 5.0 + np.arange(10_000) / 1000
    power = np.where(np.arange(10_000) == 7345, 900.0, 300.0)
    path.parent.mkdir(exist_ok=True)
    pq.write_table(pa.table({"time": time, "q_j1": np.sin(time), "power": power}), f"{path}.parquet")
    pq.write_table(pa.table({"time": time, "power_model": power - 20.0}), f"{path}.model.parquet")


REPORT = """<!DOCTYPE html><title>Arm_A</title><p id="said">nothing</p><script>
fetch("/sparql?query=ASK{}").then(() => { said.textContent = "it read"; }, () => { said.textContent = "kept out"; });
</script>"""
