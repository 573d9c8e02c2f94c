"""A soak of `irtwin live` beside `irtwin serve`: robots that send, clients that ask and look on, and memory over time.

python bench/live_soak.py [MINUTES ROBOTS HZ] [--server]      ten minutes of 20 robots at 50 Hz

Both run as they are called, on a workspace of their own in which each robot has the baseline twin of the shipped logs.
Four clients ask questions and pages again and again, four follow samples as events, and one opens a stream after the
other and leaves. Memory of each process is sampled. After the first fifth of the time it must be flat: the growth of a
process is that of a straight line through its samples, from there to the end, and twice the line's standard error is
allowed, and 2 % of what the process holds, which is the allocator's. A worker that was replaced begins anew.

The store in `irtwin live` caches blocks of its files, each flush makes new ones, and the cache has room for 128 MB: it
fills for some half an hour, and `live` may grow by that much. With `--server` the graph is on an `oxigraph` server,
which has that cache, and `live` must be as flat as all others.
"""

from __future__ import annotations

import re
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import dataclass, field
from pathlib import Path

import httpx
import numpy as np
import psutil
from sqlalchemy import func, select

from irtwin.knowledge.mapping import refresh
from irtwin.knowledge.questions.queries import named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage.database import Workspace
from irtwin.storage.schema import LIVE_RUN, RunRow
from live import add_robot, kr6, oxigraph_server
from soak import serving

WARM_UP = 0.2  # of the time
ALLOWED = 0.02  # of what a process holds
CACHE = 134.2  # MB: of the store's blocks, as its own log of an opening says
EVERY = 2.0  # s between two samples of memory
QUESTIONS = ("running_now", "energy_per_robot", "alarms", "current_state")
PAGES = ("/", "/live", "/query")


@dataclass
class Outcome:
    """What a soak saw: `memory` of each process, by its name, as (s, MB)."""

    statuses: Counter[str] = field(default_factory=Counter)
    errors: list[str] = field(default_factory=list)
    memory: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    store_in: str = "live"  # the process that has the store open to write
    events: int = 0
    sent: int = 0
    stored: int = 0
    said: list[str] = field(default_factory=list)  # by `irtwin live`

    def growth(self, name: str) -> tuple[float, float]:
        """Return by how many MB a process grew after the warm-up, and how many are allowed."""
        at, held = np.array(self.memory[name]).T
        late = at >= at[0] + WARM_UP * (at[-1] - at[0])
        if late.sum() < 8:
            return 0.0, np.inf  # it hardly lived
        at, held = at[late], held[late]
        (slope, _), covariance = np.polyfit(at, held, 1, cov=True)
        length = at[-1] - at[0]
        noise = 2 * np.sqrt(covariance[0, 0]) * length + ALLOWED * np.median(held)
        return float(slope * length), float(noise + (CACHE if name == self.store_in else 0.0))

    def grown(self) -> list[str]:
        """Return the processes that grew by more than is allowed."""
        return [name for name in self.memory if self.growth(name)[0] > self.growth(name)[1]]

    def report(self) -> str:
        """Return the figures, line by line."""
        lines = [
            f"samples sent {self.sent}, stored {self.stored}, lost {self.sent - self.stored}; events {self.events}",
            f"answers: {dict(sorted(self.statuses.items()))}; unexpected: {len(self.errors)}",
            *self.errors[:10],
            *(f"live: {line}" for line in self.said),
        ]
        for name, samples in self.memory.items():
            at, held = np.array(samples).T
            fifths = [
                float(held[max(0, np.searchsorted(at, at[-1] * share) - 1)]) for share in (0.2, 0.4, 0.6, 0.8, 1.0)
            ]
            growth, allowed = self.growth(name)
            shown = ", ".join(f"{value:.1f}" for value in fifths)
            lines.append(f"{name}, from {at[0]:.0f} s: MB at each fifth {shown}; grew {growth:+.1f} of {allowed:.1f}")
        return "\n".join([*lines, f"grew by more than is allowed: {', '.join(self.grown()) or 'none'}"])


def soak(folder: Path, seconds: float, robots: int, rate: float, on_server: bool = False) -> Outcome:
    """Soak both on a new workspace in a folder, its graph there or on a server."""
    with oxigraph_server() if on_server else nullcontext() as graph_url:
        return soak_on(folder, seconds, robots, rate, graph_url)


def soak_on(folder: Path, seconds: float, robots: int, rate: float, graph_url: str | None) -> Outcome:
    """Soak both; the graph is on a server, else in the folder."""
    outcome = Outcome(store_in="live" if graph_url is None else "server")
    fill(folder, robots, graph_url)
    where = [] if graph_url is None else ["--graph", graph_url]
    over = threading.Event()
    with serving(folder, *where) as (url, serve), watching(folder, outcome.said, *where) as (port, live):
        command = [sys.executable, str(Path(__file__).parent / "live.py"), "send"]
        sender = subprocess.Popen(
            [*command, str(port), str(robots), str(seconds), str(rate)], stdout=subprocess.PIPE, text=True
        )
        work = [lambda: ask(url, over, outcome)] * 4 + [lambda: look_on(url, over, outcome)] * 4
        threads = [threading.Thread(target=guarded, args=(task, outcome)) for task in [*work, lambda: leave(url, over)]]
        for thread in threads:
            thread.start()
        began = time.monotonic()
        while sender.poll() is None:
            sample(outcome, time.monotonic() - began, live, serve)
            time.sleep(EVERY)
        assert sender.stdout is not None
        outcome.sent = int(sender.stdout.read()) * robots
        over.set()
        for thread in threads:
            thread.join()
    with Workspace(folder) as place, place.reading() as session:
        stored = session.scalar(select(func.sum(RunRow.sample_count)).where(RunRow.kind == LIVE_RUN))
        outcome.stored = int(stored or 0)
    return outcome


def fill(folder: Path, robots: int, graph_url: str | None) -> None:
    """Make a workspace of robots with twins, and its graph."""
    known = kr6()
    with Workspace(folder, graph_url=graph_url) as place, KnowledgeGraph.of_workspace(place) as graph:
        graph.load_ontology()
        for number in range(robots):
            add_robot(place, f"R{number:03d}", known)
        refresh(graph, place.engine, place.resources.paths("mappings"), place.mapped_rows)


@contextmanager
def watching(folder: Path, said: list[str], *where: str) -> Iterator[tuple[int, psutil.Process]]:
    """Run `irtwin live` on a free port; it must end as it should. What it says is gathered."""
    command = [sys.executable, "-m", "irtwin", "live", "--port", "0", "--workspace", str(folder), *where]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, text=True)
    assert process.stderr is not None
    stderr = process.stderr
    found = None
    while found is None:
        found = re.search(r"Listening on \S+:(\d+)", stderr.readline())
    reading = threading.Thread(target=lambda: said.extend(line.rstrip() for line in stderr))
    reading.start()
    try:
        yield int(found[1]), psutil.Process(process.pid)
    finally:
        process.send_signal(signal.SIGTERM)
        assert process.wait(timeout=300) == 0
        reading.join()


def guarded(task: Callable[[], None], outcome: Outcome) -> None:
    """Do a task; what ends it is an error that the soak reports."""
    try:
        task()
    except Exception as error:  # whatever it is: the other tasks go on
        outcome.errors.append(f"{type(error).__name__}: {error}")


def ask(url: str, over: threading.Event, outcome: Outcome) -> None:
    """Ask questions and pages until it is over, five a second."""
    with httpx.Client(timeout=60) as http:
        while True:
            for name in QUESTIONS:
                answer = http.get(f"{url}/sparql", params={"query": named_questions()[name].text})
                if note(answer, outcome) and over.wait(0.2):
                    return
            for page in PAGES:
                if note(http.get(url + page), outcome) and over.wait(0.2):
                    return


def note(answer: httpx.Response, outcome: Outcome) -> bool:
    """Count an answer; one that is neither there nor put off is an error."""
    put_off = "retry-after" in answer.headers
    outcome.statuses["put off" if put_off else str(answer.status_code)] += 1
    if answer.status_code != 200 and not put_off:
        outcome.errors.append(f"{answer.status_code}: {answer.text[:200]!r}, {str(answer.request.url)[:80]}")
    return True


def look_on(url: str, over: threading.Event, outcome: Outcome) -> None:
    """Follow a robot's samples; a page that is let go comes again, as a browser does."""
    with httpx.Client(timeout=60) as http:
        while not over.is_set():
            with http.stream("GET", f"{url}/live/R000/events") as answer:
                for line in answer.iter_lines():
                    outcome.events += line.startswith("data:")
                    if over.is_set():
                        return


def leave(url: str, over: threading.Event) -> None:
    """Open one stream after the other, and leave."""
    while not over.wait(1.0):
        with suppress(httpx.ReadTimeout), httpx.stream("GET", f"{url}/live/R001/events", timeout=5) as answer:
            next(answer.iter_lines())


def sample(outcome: Outcome, at: float, live: psutil.Process, serve: psutil.Process) -> None:
    """Look at the memory of both processes and of the workers of `serve`."""
    workers = {f"worker {worker.pid}": worker for worker in serve.children()}
    for name, process in {"live": live, "serve": serve, **workers}.items():
        with suppress(psutil.Error):
            outcome.memory.setdefault(name, []).append((at, process.memory_info().rss / 1e6))


if __name__ == "__main__":
    minutes, robots, rate = [float(argument) for argument in sys.argv[1:4] if argument[0] != "-"] or (10.0, 20.0, 50.0)
    with tempfile.TemporaryDirectory() as name:
        print(soak(Path(name), 60 * minutes, int(robots), rate, "--server" in sys.argv).report())
