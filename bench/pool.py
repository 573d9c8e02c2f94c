"""What the endpoint's workers cost and what they save, beside the plain store in the same process.

python bench/pool.py GRAPH [REPEATS]     GRAPH is the graph folder of a workspace

Prints how long a small question takes of either, when a query without end is over, how long until its worker is
replaced, and what memory a worker takes.
"""

from __future__ import annotations

import asyncio
import statistics
import sys
import time
from pathlib import Path

import psutil

from irtwin.knowledge.store.snapshot import Snapshot
from irtwin.location import Location
from irtwin.serve.pool import Limits, Pool, Worker
from irtwin.serve.protocol import Refusal

SMALL = "SELECT ?name WHERE { ?joint a irt:Robot_Joint ; irt:Joint_Name ?name }"
ENDLESS = "SELECT (COUNT(*) AS ?n) WHERE { ?a ?b ?c . ?d ?e ?f . ?g ?h ?i . ?j ?k ?l }"
SECONDS = 2.0  # limit of a query


async def asked(worker: Worker, query: str) -> int:
    """Return how many bytes a worker answers."""
    request = {"text": query, "default_graphs": [], "named_graphs": [], "base": None, "accept": "*/*", "at_once": False}
    await worker.ask(request)
    return sum([len(piece) async for piece in worker.pieces()])


async def in_workers(graph: Path, repeats: int) -> None:
    pool = Pool(Location(graph.parent), 2, Limits(seconds=SECONDS))
    await pool.open()
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        async with pool.worker("127.0.0.1") as worker:
            await asked(worker, SMALL)
        times.append(time.perf_counter() - began)
    memory = max(psutil.Process(worker.pid).memory_info().rss for worker in pool.workers)
    print(f"workers: {statistics.median(times) * 1e3:.2f} ms (median of {repeats}), {memory >> 20} MB a worker")
    before = {worker.pid for worker in pool.workers}
    began = time.perf_counter()
    try:
        async with asyncio.timeout(SECONDS), pool.worker("127.0.0.1") as worker:
            await asked(worker, ENDLESS)
    except (TimeoutError, Refusal) as error:
        print(f"a query without end: over after {time.perf_counter() - began:.2f} s ({type(error).__name__})")
    ended = time.perf_counter()
    while len({worker.pid for worker in pool.workers} - before) == 0:
        await asyncio.sleep(0.01)
    print(f"its worker: replaced {time.perf_counter() - ended:.2f} s later")
    await pool.close()


def in_process(graph: Path, repeats: int) -> None:
    times = []
    with Snapshot(graph) as snapshot:
        for _ in range(repeats):
            began = time.perf_counter()
            snapshot.graph.query(SMALL)
            times.append(time.perf_counter() - began)
    print(f"plain store: {statistics.median(times) * 1e3:.2f} ms (median of {repeats}); nothing can stop a query")


if __name__ == "__main__":
    folder, count = Path(sys.argv[1]), int(sys.argv[2]) if len(sys.argv) > 2 else 200
    in_process(folder, count)
    asyncio.run(in_workers(folder, count))
