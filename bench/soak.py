"""A soak of the endpoint: clients that ask everything it answers, some rudely, while another process writes.

python bench/soak.py WORKSPACE [MINUTES] [CLIENTS]      a workspace that `irtwin run` made; it gets one more named graph

Eight clients ask named questions in every form, by GET and by POST, make mistakes, leave early and ask for too much.
A ninth follows what a writer puts into the graph, and measures how old it is when it is seen. Every answer is checked:
its status, and that a question's answer is the one that it had at first. What server and workers hold in memory, file
descriptors and threads is sampled; what grows from the first to the last quarter is called a leak.
"""

from __future__ import annotations

import random
import re
import signal
import statistics
import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import psutil
from pyoxigraph import Literal, NamedNode, Triple

from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.named_graphs import in_graph

LIVE = "http://example.com/soak"
TOO_MUCH = "SELECT (COUNT(*) AS ?n) { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i }"
RESULTS = ("application/sparql-results+json", "application/sparql-results+xml", "text/csv", "text/tab-separated-values")
TRIPLES = ("text/turtle", "application/n-triples", "application/rdf+xml", "application/ld+json")
TIME_LIMIT = 10  # s per query


@dataclass
class Sample:
    """What the server's processes hold at a moment: seconds since the start, MB, counts."""

    time: float
    server: float
    largest_worker: float
    files: int
    threads: int


@dataclass
class Outcome:
    """What a soak saw. Latencies in seconds, of answers that came; lags from commit to sight."""

    statuses: Counter[str] = field(default_factory=Counter)
    errors: list[str] = field(default_factory=list)
    latencies: list[float] = field(default_factory=list)
    lags: list[float] = field(default_factory=list)
    samples: list[Sample] = field(default_factory=list)

    def growth(self, name: str) -> float:
        """Return by how much the median of the last quarter of samples is above that of the first."""
        values = [getattr(sample, name) for sample in self.samples]
        quarter = max(1, len(values) // 4)
        return statistics.median(values[-quarter:]) - statistics.median(values[:quarter])

    def report(self) -> str:
        """Return the figures, line by line."""
        last = self.samples[-1]
        lines = [
            f"{sum(self.statuses.values())} requests in {last.time:.0f} s: {dict(sorted(self.statuses.items()))}",
            f"unexpected: {len(self.errors)}",
            *self.errors[:10],
            f"latency of answers: {_quantiles(self.latencies)}",
            f"from a writer's commit to an answer that holds it: {_quantiles(self.lags)}",
        ]
        for name in ("server", "largest_worker", "files", "threads"):
            values = [getattr(sample, name) for sample in self.samples]
            lines.append(
                f"{name}: {min(values):.0f} to {max(values):.0f}, last quarter above first by {self.growth(name):.1f}"
            )
        return "\n".join(lines)


class Client:
    """One client, with a connection and a chance of its own."""

    def __init__(self, url: str, seed: int, outcome: Outcome, first: dict[tuple[str, str], bytes]):
        self._url = url
        self._chance = random.Random(seed)
        self._outcome = outcome
        self._first = first
        self._http = httpx.Client(timeout=3 * TIME_LIMIT)

    def run(self, until: float) -> None:
        """Ask until the time has come."""
        ways = (self._question, self._describe, self._mistake, self._page, self._leave, self._too_much)
        while time.monotonic() < until:
            (way,) = self._chance.choices(ways, weights=(70, 12, 10, 6, 1.5, 0.3))
            try:
                way()
            except Exception as error:
                self._outcome.errors.append(f"{way.__name__}: {type(error).__name__}: {error}")

    def _question(self) -> None:
        name = self._chance.choice(list(named_questions()))
        text, accept = named_questions()[name].text, self._chance.choice(RESULTS)
        response = self._ask(text, accept, 200)
        if response.status_code == 200 and self._first.setdefault((name, accept), response.content) != response.content:
            self._outcome.errors.append(f"{name} as {accept} changed")

    def _describe(self) -> None:
        self._ask(
            "CONSTRUCT { ?s ?p ?o } WHERE { ?s a irt:Industrial_Robot ; ?p ?o }", self._chance.choice(TRIPLES), 200
        )

    def _mistake(self) -> None:
        text, accept, status = self._chance.choice(
            (
                ("SELECT nothing", "*/*", 400),
                ("SELECT * { SERVICE <http://127.0.0.1:1/> { ?s ?p ?o } }", "*/*", 400),
                ("ASK " + "{" * 20_000 + "}" * 20_000, "*/*", 400),
                ("ASK {}", "image/png", 406),
            )
        )
        self._ask(text, accept, status)

    def _page(self) -> None:
        for path in ("/", "/sparql", "/assets/yasqe.min.js", "/irtwin/robot"):
            self._count(self._http.get(self._url + path), 200)

    def _leave(self) -> None:
        with suppress(httpx.ReadTimeout):
            self._http.post(f"{self._url}/sparql", data={"query": TOO_MUCH}, timeout=0.5)
        self._outcome.statuses["left early"] += 1

    def _too_much(self) -> None:
        self._ask(TOO_MUCH, "*/*", 503)

    def _ask(self, text: str, accept: str, expected: int) -> httpx.Response:
        began = time.monotonic()
        url, headers = f"{self._url}/sparql", {"Accept": accept}
        if len(text) < 5000 and self._chance.random() < 0.5:
            response = self._http.get(url, params={"query": text}, headers=headers)
        else:
            headers["Content-Type"] = "application/sparql-query"
            response = self._http.post(url, content=text, headers=headers)
        self._count(response, expected)
        if expected == 200:
            self._outcome.latencies.append(time.monotonic() - began)
        return response

    def _count(self, response: httpx.Response, expected: int) -> None:
        if "retry-after" in response.headers:  # back-pressure, said as such
            self._outcome.statuses["put off"] += 1
            return
        self._outcome.statuses[str(response.status_code)] += 1
        if response.status_code != expected:
            asked = str(response.request.url)[-60:]
            self._outcome.errors.append(f"{response.status_code}, not {expected}: {response.text[:200]!r}, {asked}")


def soak(workspace: Path, seconds: float, clients: int) -> Outcome:
    """Soak a server on a workspace's graph; the workspace is written to."""
    outcome = Outcome()
    with serving(workspace) as (url, process):
        began = time.monotonic()
        first: dict[tuple[str, str], bytes] = {}
        asking = [Client(url, seed, outcome, first).run for seed in range(clients)]
        following = [lambda until: follow(url, workspace / "graph", until, outcome.lags)]
        threads = [threading.Thread(target=work, args=(began + seconds,)) for work in asking + following]
        for thread in threads:
            thread.start()
        while any(thread.is_alive() for thread in threads):
            outcome.samples.append(sample(process, time.monotonic() - began))
            time.sleep(min(2.0, seconds / 20))
        for thread in threads:
            thread.join()
    return outcome


@contextmanager
def serving(workspace: Path, *where: str) -> Iterator[tuple[str, psutil.Process]]:
    """Run `irtwin serve` on a free port; it must end as it should."""
    command = [sys.executable, "-m", "irtwin", "serve", "--port", "0", "--workspace", str(workspace), *where]
    server = subprocess.Popen([*command, "--timeout", str(TIME_LIMIT)], stdout=subprocess.PIPE, text=True)
    assert server.stdout is not None
    try:
        found = re.search(r"http://\S+(?=/sparql)", server.stdout.readline())
        assert found is not None
        yield found[0], psutil.Process(server.pid)
    finally:
        server.send_signal(signal.SIGTERM)
        assert server.wait(timeout=30) == 0


def follow(url: str, folder: Path, until: float, lags: list[float]) -> None:
    """Write numbers into the graph, one after the other, and wait until the endpoint shows each."""
    subject, predicate = NamedNode(f"{LIVE}/subject"), NamedNode(f"{LIVE}/number")
    query = f"SELECT ?n {{ {subject} {predicate} ?n }}"
    number = 0
    with KnowledgeGraph(folder) as graph, httpx.Client(timeout=3 * TIME_LIMIT) as http:
        while time.monotonic() < until:
            number += 1
            graph.replace(in_graph([Triple(subject, predicate, Literal(number))], LIVE), LIVE)
            written = time.monotonic()
            shown = ""
            while shown != str(number) and time.monotonic() < until:
                shown = (
                    http.get(f"{url}/sparql", params={"query": query}, headers={"Accept": "text/csv"}).text[3:].strip()
                )
                time.sleep(0.02)
            lags.append(time.monotonic() - written)
            time.sleep(0.5)
        graph.replace([], LIVE)


def sample(server: psutil.Process, at: float) -> Sample:
    """Look at the server and its workers."""
    sizes, files, threads = [0.0], server.num_fds(), server.num_threads()
    for worker in server.children():
        with suppress(psutil.Error):
            sizes.append(worker.memory_info().rss / 1e6)
            threads += worker.num_threads()
    return Sample(at, server.memory_info().rss / 1e6, max(sizes), files, threads)


def _quantiles(values: list[float]) -> str:
    if len(values) < 2:
        return "none"
    cuts = statistics.quantiles(values, n=100)
    return f"p50 {cuts[49] * 1000:.0f} ms, p99 {cuts[98] * 1000:.0f} ms, max {max(values) * 1000:.0f} ms"


if __name__ == "__main__":
    arguments = sys.argv[1:]
    minutes = float(arguments[1]) if len(arguments) > 1 else 10.0
    print(soak(Path(arguments[0]), 60 * minutes, int(arguments[2]) if len(arguments) > 2 else 8).report())
