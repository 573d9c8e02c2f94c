"""Loading a workspace's graph beside plain Oxigraph, as a ratio: python bench/loading.py FOLDER [ROBOTS] [RUNS]

A fleet's graph (`graph.py`), N-Quads in their named graphs, is loaded by irtwin, which holds the union of its graphs
beside them, by `pyoxigraph.Store.bulk_load` alone, and by that with the union as a second file; on disk and in memory,
in turn, three times, each in a process of its own. It prints the seconds by the clock, those of the processor of all
threads, each the least of three, and the ratios to ours.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
import time
from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

from pyoxigraph import RdfFormat, Store, parse

from graph import prepare
from irtwin.knowledge.store.graph import KnowledgeGraph

ROUNDS = 3


def ours(place: Path | None, quads: Path, triples: Path) -> None:
    graph = KnowledgeGraph() if place is None else KnowledgeGraph(place)
    graph.replace(parse(path=quads), "")


def plain(place: Path | None, quads: Path, triples: Path) -> Store:
    store = Store() if place is None else Store(str(place))
    store.bulk_load(path=str(quads), format=RdfFormat.N_QUADS)
    return store


def with_union(place: Path | None, quads: Path, triples: Path) -> None:
    plain(place, quads, triples).bulk_load(path=str(triples), format=RdfFormat.N_TRIPLES)


LOADS: dict[str, Callable[[Path | None, Path, Path], object]] = {
    "irtwin": ours,
    "Oxigraph": plain,
    "Oxigraph with the union": with_union,
}


def alone(name: str, place: Path | None, quads: Path, triples: Path) -> None:
    """Load once, and print what it took."""
    began, own = time.perf_counter(), time.process_time()
    LOADS[name](place, quads, triples)
    print(time.perf_counter() - began, time.process_time() - own)


def main(folder: Path, robots: int = 5, runs: int = 100) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    made = prepare(folder, robots, runs)
    files = [str(made["named.nq"]), str(made["all.nt"])]
    taken: dict[tuple[str, str], list[tuple[float, float]]] = defaultdict(list)
    for _ in range(ROUNDS):
        for kind in ("on disk", "in memory"):
            for name in LOADS:
                place = folder / "loaded"
                shutil.rmtree(place, ignore_errors=True)
                child = [sys.executable, __file__, "--alone", name, str(place if kind == "on disk" else ""), *files]
                clock, own = subprocess.run(child, stdout=subprocess.PIPE, text=True, check=True).stdout.split()
                taken[kind, name].append((float(clock), float(own)))
    for kind in ("on disk", "in memory"):
        best = {name: [min(times) for times in zip(*taken[kind, name], strict=True)] for name in LOADS}
        for name, (clock, own) in best.items():
            print(f"{kind}, {name}: {clock:.2f} s, {own:.2f} s of the processor")
        for name in list(LOADS)[1:]:
            clock, own = (mine / theirs for mine, theirs in zip(best["irtwin"], best[name], strict=True))
            print(f"{kind}, irtwin over {name}: {clock:.2f} by the clock, {own:.2f} of the processor")


if __name__ == "__main__":
    if sys.argv[1] == "--alone":
        name, place, *files = sys.argv[2:]
        alone(name, Path(place) if place else None, *map(Path, files))
    else:
        main(Path(sys.argv[1]), *map(int, sys.argv[2:]))
