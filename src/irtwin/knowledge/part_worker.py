"""A process that works on parts of a graph, as it stands on disk, and tells another what it made of them.

It is told once where the graph is and what to do, then of some robots at a time, and answers each time: by pickles on
standard input and output. It is a new process, not a copy: a copy of one that has a store open may wait for ever for a
lock that a thread of the store held.
"""

from __future__ import annotations

import pickle
import subprocess
import sys
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Self, TypeVar

from irtwin.knowledge import parts
from irtwin.knowledge.garbage import seldom_collected
from irtwin.knowledge.parts import Name, Ontology, Region, Seen
from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.resources import Resources

Made = TypeVar("Made")


@dataclass(frozen=True)
class PartTask(Generic[Made]):
    """Where the graph is, what extends it, and what to do with some parts of it."""

    place: Path
    resources: Resources
    work: Callable[[Ontology, list[Region]], Iterator[Made]]


class PartWorker(Generic[Made]):
    """Such a process, seen from the one that asks; to be used as a context."""

    def __init__(self, told: PartTask[Made]):
        self._process = subprocess.Popen(
            [sys.executable, "-m", "irtwin.knowledge.part_worker"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,  # Ctrl-C in the terminal is for who asks
        )
        self._tell(told)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._process.kill()
        self._process.communicate()

    def ask(self, robots: list[Name]) -> tuple[list[Made], Seen]:
        """Return what the work makes of some robots' parts, and what was read.

        A part of several robots is worked on with the first of them. Raises what the work raises, and ChildProcessError
        where the process ended.
        """
        assert self._process.stdout is not None
        try:
            self._tell(robots)
            answer = pickle.load(self._process.stdout)
        except (EOFError, OSError) as gone:
            raise ChildProcessError(
                f"the process that works on {len(robots)} robots ended with {self._process.wait()}"
            ) from gone
        if isinstance(answer, BaseException):
            raise answer
        made: tuple[list[Made], Seen] = answer
        return made

    def _tell(self, what: object) -> None:
        assert self._process.stdin is not None
        pickle.dump(what, self._process.stdin)
        self._process.stdin.flush()


@seldom_collected()
def main() -> None:
    """Answer until standard input ends."""
    source, out = sys.stdin.buffer, sys.stdout.buffer
    told: PartTask[Any] = pickle.load(source)
    with KnowledgeGraph.as_it_stands(told.place, resources=told.resources) as graph:
        ontology = Ontology(graph)
        robots = set(parts.robots_of(graph, ontology))
        while True:
            try:
                batch = pickle.load(source)
            except EOFError:
                return
            pickle.dump(_answer(graph, ontology, robots, batch, told), out, protocol=pickle.HIGHEST_PROTOCOL)
            out.flush()


def _answer(
    graph: KnowledgeGraph, ontology: Ontology, robots: set[Name], batch: list[Name], told: PartTask[Made]
) -> object:
    seen, made, own = Seen(), list[Made](), set(batch)

    def regions() -> Iterator[Region | None]:
        for region in parts.some(graph, ontology, batch):
            if region is None:
                yield None
            elif min(region.nodes & robots, key=str) in own:  # else of who is asked for that robot
                seen.note(region)
                yield region

    try:
        for some in parts.together(regions()):
            made += told.work(ontology, some)
    except Exception as error:  # raised where it was asked for
        error.add_note(traceback.format_exc())
        return error
    return made, seen


if __name__ == "__main__":
    main()
