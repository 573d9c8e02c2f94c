"""Some work with each part of a graph: of many robots in several processes, each with a view of the graph of its own.

This process alone writes. A part is read, worked on and dropped where the work is done, and only what is made of it is
handed over, so memory does not grow with the number of robots.
"""

from __future__ import annotations

import os
from collections import Counter, deque
from collections.abc import Callable, Generator, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import ExitStack, closing
from queue import SimpleQueue
from typing import TypeVar

from irtwin.knowledge import parts
from irtwin.knowledge.part_worker import PartTask, PartWorker
from irtwin.knowledge.parts import MOST_TOGETHER, Name, Ontology, Region, Seen
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.snapshot import view

LEAST_FOR_WORKERS = 200_000  # quads: these take some 10 s to be reasoned over, a worker 1.5 s to begin
MOST_WORKERS = 8  # more than this process can write for

Made = TypeVar("Made")
Work = Callable[[Ontology, list[Region]], Iterator[Made]]  # with some parts together


def of_these(ontology: Ontology, regions: Iterable[Region | None], work: Work[Made]) -> Generator[Made, None, None]:
    """Yield what some work makes of some parts. Raises Joined where they are not parts, and what the work raises."""
    for some in parts.together(regions):
        yield from work(ontology, some)


def of_each(graph: KnowledgeGraph, ontology: Ontology, work: Work[Made]) -> Generator[Made, None, None]:
    """Yield what some work makes of the ontology alone, as of a part without nodes, and of all parts, robots first.

    Raises as `of_these` does, and ChildProcessError where a process ended before its time. To be closed in the end.
    """
    held, seen = parts.held(graph), Seen()

    def noted(regions: Iterable[Region | None]) -> Iterator[Region | None]:
        for region in regions:
            if region is not None:
                seen.note(region)
            yield region

    yield from of_these(ontology, noted([parts.of_ontology(graph, ontology)]), work)
    robots = parts.robots_of(graph, ontology)
    batches = list(_batches(robots, held))
    with ExitStack() as begun:
        workers = _workers(graph, ontology, work, len(batches), held, begun)
        if workers:
            for made, read in begun.enter_context(closing(_shared(workers, batches))):
                seen.add(read)
                yield from made
        else:
            yield from of_these(ontology, noted(parts.some(graph, ontology, robots)), work)
    yield from of_these(ontology, noted(parts.left(graph, ontology, held, seen)), work)


def _batches(robots: list[Name], held: Counter[str]) -> Iterator[list[Name]]:
    """Yield robots, small ones some at a time."""
    size = max(1, MOST_TOGETHER * len(robots) // max(1, held.total()))
    return (robots[at : at + size] for at in range(0, len(robots), size))


def _workers(
    graph: KnowledgeGraph, ontology: Ontology, work: Work[Made], batches: int, held: Counter[str], begun: ExitStack
) -> list[PartWorker[Made]]:
    """Begin processes for batches of robots, if it is worth it; they end with `begun`."""
    count = min(batches, _processors(), MOST_WORKERS)
    if count < 2 or held.total() < LEAST_FOR_WORKERS or graph.folder is None:
        return []
    place = begun.enter_context(view(graph.folder))
    if place is None:  # no view can be had
        return []
    told = PartTask(place, ontology.resources, work)
    return [begun.enter_context(PartWorker(told)) for _ in range(count)]


def _shared(
    workers: list[PartWorker[Made]], batches: Iterable[list[Name]]
) -> Generator[tuple[list[Made], Seen], None, None]:
    """Yield what workers make of batches of robots, in their order, and what they read; few wait to be taken."""
    idle: SimpleQueue[PartWorker[Made]] = SimpleQueue()
    for worker in workers:
        idle.put(worker)

    def ask(batch: list[Name]) -> tuple[list[Made], Seen]:
        worker = idle.get()
        try:
            return worker.ask(batch)
        finally:
            idle.put(worker)

    waiting: deque[Future[tuple[list[Made], Seen]]] = deque()
    executor = ThreadPoolExecutor(len(workers))
    try:
        for batch in batches:
            waiting.append(executor.submit(ask, batch))
            if len(waiting) > 2 * len(workers):
                yield waiting.popleft().result()
        while waiting:
            yield waiting.popleft().result()
    finally:
        executor.shutdown(wait=False, cancel_futures=True)  # who still waits for a worker is told when that ends


def _processors() -> int:
    """Return how many processors this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
