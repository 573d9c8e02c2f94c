"""What reasoning and validation of a fleet cost: python bench/fleet_reasoning.py FOLDER [ROBOTS] [RUNS] [whole]

FOLDER is to be new. Each step runs in a process of its own. It prints its seconds of the processor, the seconds that
went by, and the most memory that it held, its imports among it; "five rows" are five energies of one robot, changed in
the database. With `whole` the graph is then reasoned over as
one part, and what follows is compared triple by triple: some 0.5 ms and 2 kB a triple.
"""

from __future__ import annotations

import os
import sqlite3
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

import fleet
from irtwin import rewriting
from irtwin.knowledge import reasoning
from irtwin.knowledge.parts import Ontology
from irtwin.knowledge.reasoning import reason
from irtwin.knowledge.shacl.validation import validate
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.vocabulary import GRAPH_INFERRED
from irtwin.storage.database import Workspace

STEPS = ("mapping", "reasoning", "validation", "five rows")
FIVE_ROWS = """
UPDATE run_energy SET peak_power_w = peak_power_w + 1, energy_error_percent = energy_error_percent + 1
WHERE run_id IN (SELECT run_id FROM run_energy WHERE run_id LIKE 'R001.%' ORDER BY run_id LIMIT 5)"""
T = TypeVar("T")


def timed(what: str, do: Callable[[], T]) -> T:
    """Do something and say what it took."""
    began, own = time.perf_counter(), time.process_time()
    found = do()
    wall, own = time.perf_counter() - began, time.process_time() - own
    status = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
    most = next(int(line.split()[1]) for line in status if line.startswith("VmHWM"))
    print(
        f"{what}: {own:.1f} s, {wall:.1f} s by the clock at load {os.getloadavg()[0]:.1f}; {most / 2**20:.2f} GB",
        flush=True,
    )
    return found


def step(place: Path, what: str) -> None:
    if what == "five rows":
        with sqlite3.connect(place / "irtwin.db") as connection:
            connection.execute(FIVE_ROWS)
    with Workspace.existing(place) as workspace, KnowledgeGraph(workspace.graph_folder, place) as graph:
        if what == "mapping":
            graph.load_ontology()
        if what in ("mapping", "five rows"):
            timed(f"{what}, mapping", lambda: rewriting.map_rows(workspace, graph))
        if what in ("reasoning", "five rows"):
            found = timed(f"{what}, reasoning", lambda: reason(graph))
            how = "each robot by itself" if found.joined_by is None else f"all together, joined by {found.joined_by}"
            print(f"  {found.owl_rl} triples from OWL 2 RL, {found.by_rules} from rules; {how}")
        if what in ("validation", "five rows"):
            print(f"  {len(timed(f'{what}, validation', lambda: validate(graph)))} violations")
        if what == "whole":
            timed("compared with the whole closure", lambda: compare(graph))


def compare(graph: KnowledgeGraph) -> None:
    """Say whether what stands in the graph is what follows from all of it as one part."""
    ontology = Ontology(graph)
    whole = reasoning.infer(ontology, reasoning.asserted(graph) - ontology.triples)
    of_whole = {it for it in whole.quads() if reasoning.graph_of(it).startswith(GRAPH_INFERRED)}
    by_parts = {it for name in graph.graphs(GRAPH_INFERRED) for it in graph.store.quads_in(name)}
    print(f"  {len(by_parts)} triples by parts, {len(of_whole)} of the whole; differ: {len(by_parts ^ of_whole)}")


def main(place: Path, robots: str = "20", runs: str = "100", *more: str) -> None:
    fleet.make_database(place, int(robots), int(runs))
    for what in (*STEPS, *more):
        subprocess.run([sys.executable, __file__, str(place), what], check=True)


if __name__ == "__main__":
    if len(sys.argv) == 3 and sys.argv[2] in (*STEPS, "whole"):
        step(Path(sys.argv[1]), sys.argv[2])
    else:
        main(Path(sys.argv[1]), *sys.argv[2:])
