"""How long each named question takes of a fleet's graph: python bench/questions.py FOLDER [TIMES]

FOLDER is what bench/fleet.py wrote. Questions of one robot are asked of one; the others of the whole fleet. Each is
asked TIMES times in a row; "first" is its first answer in this process. Of the others the least is given, by the clock
and by the processor's time, which says what it takes on a machine that does nothing else. Prints the table of
bench/QUESTIONS.md.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from irtwin.knowledge.questions.queries import NamedQuery, ask, named_questions
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.knowledge.store.reading import answers_of

ROBOT = "R001"


def measure(graph: KnowledgeGraph, question: NamedQuery, times: int) -> tuple[list[float], list[float], int]:
    """Return how long each answer took, ms, by the clock and by the processor's time, and how many rows it has."""
    clock, processor = [], []
    for _ in range(times):
        graph.answers = answers_of(graph.store)  # none is kept from before
        began, worked = time.perf_counter(), time.process_time()
        table = ask(graph, question.name, ROBOT if question.of_robot else None)
        clock.append(1000 * (time.perf_counter() - began))
        processor.append(1000 * (time.process_time() - worked))
    return clock, processor, len(table)


def main(place: Path, times: int = 10) -> None:
    print("| theme | question | asked of | rows | first, ms | least, ms | processor, ms |")
    print("| --- | --- | --- | ---: | ---: | ---: | ---: |")
    slow = []
    with KnowledgeGraph(place / "graph", read_only=True) as graph:
        for question in named_questions().values():
            clock, processor, count = measure(graph, question, times)
            of = "a robot" if question.of_robot else "the fleet"
            figures = f"{clock[0]:.0f} | {min(clock[1:]):.1f} | {min(processor[1:]):.1f}"
            print(f"| {question.theme} | {question.name} | {of} | {count} | {figures} |", flush=True)
            if min(processor[1:]) > 50:
                slow.append(question.name)
    print(f"\n{len(named_questions())} questions; over 50 ms of the processor's time: {', '.join(slow) or 'none'}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:]))
