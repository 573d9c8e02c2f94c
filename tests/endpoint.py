"""`irtwin serve` in a process of its own, and a small graph for it."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path

import httpx
import psutil
from pyoxigraph import RdfFormat, parse

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE

TWO_ROBOTS = Path(__file__).parent / "knowledge/data/two_robots.trig"
TOKEN = "a-token-for-tests"
CLIENT = httpx.Client(timeout=60, limits=httpx.Limits(max_connections=32))


@dataclass
class Server:
    """An `irtwin serve` process."""

    url: str
    graph: Path
    process: subprocess.Popen[str]

    @property
    def sparql(self) -> str:
        return f"{self.url}/sparql"

    def ask(self, query: str, **headers: str) -> httpx.Response:
        body = {"Content-Type": "application/sparql-query", **headers}
        return CLIENT.post(self.sparql, content=query, headers=body)

    def update(self, text: str, token: str = TOKEN) -> httpx.Response:
        headers = {"Content-Type": "application/sparql-update", "Authorization": f"Bearer {token}"}
        return CLIENT.post(self.sparql, content=text, headers=headers)

    def workers(self) -> dict[int, float]:
        """Return the processor time in seconds of each worker that lives, by its process."""
        found = {}
        for worker in psutil.Process(self.process.pid).children():
            with suppress(psutil.NoSuchProcess):
                if worker.status() != psutil.STATUS_ZOMBIE:
                    found[worker.pid] = sum(worker.cpu_times()[:2])
        return found


@contextmanager
def serving(graph: Path, *arguments: object, token: str | None = TOKEN) -> Iterator[Server]:
    environment = {name: value for name, value in os.environ.items() if name != "IRTWIN_TOKEN"}
    if token is not None:
        environment["IRTWIN_TOKEN"] = token
    command = [sys.executable, "-m", "irtwin", "serve", "--port", "0", "--workspace", str(graph.parent)]
    process = subprocess.Popen(
        [*command, *map(str, arguments)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environment
    )
    try:
        assert process.stdout is not None and process.stderr is not None
        line = process.stdout.readline()
        found = re.search(r"http://\S+(?=/sparql)", line)
        assert found, (line, process.stderr.read())
        yield Server(found[0], graph, process)
    finally:
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=20)
        assert process.returncode == 0, errors
        assert "Traceback" not in errors, errors


def make_graph(folder: Path) -> Path:
    """Make a workspace's graph of the ontology and two robots, and return its folder."""
    with KnowledgeGraph(folder / "graph") as graph:
        graph.load_ontology()
        graph.replace(parse(path=str(TWO_ROBOTS), format=RdfFormat.TRIG), GRAPH_SOURCE, GRAPH_ACTIVITY)
    return folder / "graph"
