"""How long each named question takes of a fleet's graph: python bench/questions.py FOLDER [TIMES]

FOLDER is what bench/fleet.py wrote. Questions of one robot are asked of one; the others of the whole fleet. Each is asked
TIMES times in a row; "first" is its first answer in this process, the figure to go by is the least of the others.
Prints the table of bench/QUESTIONS.md.
"""

from __future__ import annotations

import sys
import time
from pathlib import Path

from irtwin.knowledge.graph import KnowledgeGraph
from irtwin.knowledge.queries import Question, ask, named_questions

ROBOT = "R001"


def measure(graph: KnowledgeGraph, question: Question, times: int) -> tuple[list[float], int]:
    """Return how long each answer took, ms, and how many rows it has."""
    took = []
    for _ in range(times):
        began = time.perf_counter()
        table = ask(graph, question.name, ROBOT if question.of_robot else None)
        took.append(1000 * (time.perf_counter() - began))
    return took, len(table)


def main(place: Path, times: int = 10) -> None:
    with KnowledgeGraph(place / "graph", read_only=True) as graph:
        print("| theme | question | asked of | rows | first, ms | least, ms |\n| --- | --- | --- | ---: | ---: | ---: |")
        least = {}
        for question in named_questions().values():
            took, count = measure(graph, question, times)
            least[question.name] = min(took[1:])
            of = "a robot" if question.of_robot else "the fleet"
            print(f"| {question.theme} | {question.name} | {of} | {count} | {took[0]:.0f} | {least[question.name]:.1f} |")
        slow = sorted(name for name, value in least.items() if value > 50)
        print(f"\n{len(least)} questions; over 50 ms: {', '.join(slow) or 'none'}")


if __name__ == "__main__":
    main(Path(sys.argv[1]), *map(int, sys.argv[2:]))
