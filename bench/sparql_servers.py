"""Every named question of a workspace on SPARQL servers beside the embedded store, by the SPARQL 1.1 Protocol alone.

    python bench/sparql_servers.py WORKSPACE http://127.0.0.1:7878/query ...

Each server is given the workspace's graph as irtwin itself gives it (an empty server is needed), and asked. One that
does not take it is asked all the same: something else may have filled it. Answers must be equal to the last digit; what
is not is listed, with the kind of difference. A sum of floating-point numbers depends on the order that an engine adds
them in: a relative difference of 1e-12 counts as equal, and is counted.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path
from urllib.parse import urlsplit

from irtwin.asking import open_graph
from irtwin.errors import InputError
from irtwin.knowledge.questions.queries import ask, named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.table import AnswerTable
from irtwin.location import Location

SUMMED, SIX_DIGITS = 1e-12, 1e-5  # relative
LAST = "the last digits of sums"


def main(workspace: Path, urls: list[str]) -> None:
    with open_graph(Location(workspace)) as graph:
        quads = list(graph.quads())
        began = time.perf_counter()
        known = {name: ask(graph, name) for name in named_questions()}
        print(f"{len(quads):,} quads; embedded: {len(known)} questions in {time.perf_counter() - began:.1f} s")
        for url in urls:
            print(f"\n{urlsplit(url).netloc.rpartition('@')[2]}")
            server = KnowledgeGraph(url, workspace)
            try:
                began = time.perf_counter()
                if not server.graphs(""):
                    server.replace(quads, "")
                    print(f"  filled in {time.perf_counter() - began:.1f} s")
            except InputError as error:
                print(f"  not filled: {error}")
            began = time.perf_counter()
            told = {name: difference(server, name, answer) for name, answer in known.items()}
            seconds = time.perf_counter() - began
            for name, said in told.items():
                if said:
                    print(f"  {name}: {said}")
            equal = sum(said in ("", LAST) for said in told.values())
            print(f"  {equal} of {len(known)} equal, in {seconds:.1f} s")


def difference(server: KnowledgeGraph, name: str, answer: AnswerTable) -> str:
    """Say in words how a server's answer differs; nothing where it does not."""
    try:
        found = ask(server, name)
    except InputError as error:
        return " ".join(str(error).split())[:200]
    if found == answer:
        return ""
    if len(found.rows) != len(answer.rows):
        return f"{len(found.rows)} rows, not {len(answer.rows)}"
    if sorted(map(str, found.rows)) == sorted(map(str, answer.rows)):
        return "another order"
    pairs = [
        (key, row[key], other[key])
        for row, other in zip(answer.rows, found.rows, strict=True)
        for key in answer.columns
    ]
    if all(near(one, two, SUMMED) for _, one, two in pairs):
        return LAST
    apart = [(key, one, two) for key, one, two in pairs if not near(one, two, SIX_DIGITS)]
    return f"{apart[0][0]} is {apart[0][2]!r}, not {apart[0][1]!r}" if apart else "the same in six digits"


def near(one: object, two: object, within: float) -> bool:
    if isinstance(one, float) and isinstance(two, float | int):
        return abs(one - two) <= within * abs(one)
    return one == two


if __name__ == "__main__":
    main(Path(sys.argv[1]), sys.argv[2:])
