"""`irtwin serve` in a process of its own, and a small graph for it."""

from __future__ import annotations

import re
import signal
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import urlsplit

import httpx
import psutil
from pyoxigraph import RdfFormat, parse

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_ACTIVITY, GRAPH_SOURCE
from tests.forks import Command

TWO_ROBOTS = Path(__file__).parent / "knowledge/data/two_robots.trig"
TOKEN = "a-token-for-tests"
CLIENT = httpx.Client(timeout=60, limits=httpx.Limits(max_connections=32))


@dataclass
class Server:
    """An `irtwin serve` process."""

    url: str
    graph: Path
    process: Command

    @property
    def sparql(self) -> str:
        return f"{self.url}/sparql"

    def get(self, path: str, **headers: str) -> httpx.Response:
        return CLIENT.get(self.url + path, headers=headers)

    def ask(self, query: str, **headers: str) -> httpx.Response:
        body = {"Content-Type": "application/sparql-query", **headers}
        return CLIENT.post(self.sparql, content=query, headers=body)

    def update(self, text: str, token: str = TOKEN) -> httpx.Response:
        headers = {"Content-Type": "application/sparql-update", "Authorization": f"Bearer {token}"}
        return CLIENT.post(self.sparql, content=text, headers=headers)

    def connected(self, sent: bytes, of: str = "127.0.0.1") -> socket.socket:
        """Return a connection of one's own, `of` an address of this machine, by which so much was sent."""
        address = urlsplit(self.url)
        raw = socket.create_connection((address.hostname, address.port), timeout=10, source_address=(of, 0))
        raw.sendall(sent)
        return raw

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
    process = Command("serve", "--port", 0, "--workspace", graph.parent, *arguments, IRTWIN_TOKEN=token or "")
    try:
        line = process.stdout.readline()
        found = re.search(r"http://\S+(?=/sparql)", line)
        assert found, (line, process.stderr.read())
        yield Server(found[0], graph, process)
    finally:
        process.send_signal(signal.SIGTERM)
        _, errors = process.communicate(timeout=20)
        assert process.returncode == (-signal.SIGKILL if process.killed else 0), errors
        assert "Traceback" not in errors, errors


def make_graph(folder: Path) -> Path:
    """Make a workspace's graph of the ontology and two robots, and return its folder."""
    with KnowledgeGraph(folder / "graph") as graph:
        graph.load_ontology()
        graph.replace(parse(path=str(TWO_ROBOTS), format=RdfFormat.TRIG), GRAPH_SOURCE, GRAPH_ACTIVITY)
    return folder / "graph"
