"""A fleet: batches of data sets in one folder, made, worked on and counted."""

from __future__ import annotations

import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from irtwin.errors import InputError
from irtwin.fleet.batch import DONE, FAILED, REFUSED, Batch, Record
from irtwin.fleet.data_sets import find_data_sets
from irtwin.fleet.schedule import work_through
from irtwin.storage import base_iri
from irtwin.storage.files import inside

_NAME = "batch_{:04d}"
_EVERY = 5.0  # s between two lines of how far a fleet is


@dataclass(frozen=True)
class FleetStatus:
    """How many data sets are in each state (`left` where none is final), and the records of those set aside."""

    counts: Counter[str]
    set_aside: tuple[Record, ...]


def work(
    source: Path,
    folder: Path,
    kind: str,
    *,
    batch: int,
    workers: int,
    base: str | None = None,
    announce: Callable[[str], None] = lambda line: None,
) -> FleetStatus:
    """Take every data set of a source through `run` or `diagnose`, results below `folder`.

    What was done before and has not changed is not done again. `batch`: at most so many data sets share a workspace;
    `base`: what the IRIs of its individuals begin with, one for the whole fleet; it is remembered.
    Raises InputError where the source holds none, or the folder is of another kind or base.
    """
    base = None if base is None else base_iri.checked(base, "--base")
    _plan(find_data_sets(source), folder, kind, batch, workers, base)
    batches = [one for one in batches_of(folder) if one.sets.kind == kind]
    ended = count(1)

    def tell(one: Batch) -> None:
        announce(f"{one.folder.name}, {next(ended)} of {len(batches)}: {_line(status_of([one]).counts)}")

    with told_meanwhile(lambda: announce(f"  {_line(status_of(batches).counts)}")):
        work_through(batches, workers, tell)
    return status_of(batches)


@contextmanager
def told_meanwhile(tell: Callable[[], None]) -> Iterator[None]:
    """Call a function each five seconds while the block runs, and more seldom where it takes long itself."""
    over = threading.Event()

    def go_on() -> None:
        pause = _EVERY
        while not over.wait(pause):
            began = time.monotonic()
            tell()
            pause = max(_EVERY, 20 * (time.monotonic() - began))

    teller = threading.Thread(target=go_on, daemon=True)
    teller.start()
    try:
        yield
    finally:
        over.set()
        teller.join()


def _plan(
    places: Sequence[str],
    folder: Path,
    kind: str,
    size: int,
    workers: int,
    base: str | None,
) -> None:
    """Put data sets that no batch has into new ones, enough for each worker to have one."""
    there = batches_of(folder)
    if there and {one.sets.kind for one in there} != {kind}:
        raise InputError(f"{folder}: holds a fleet of `{there[0].sets.kind}`; give `{kind}` a folder of its own")
    if there and {one.sets.base for one in there} != {base}:
        said = there[0].sets.base
        raise InputError(
            f"{folder}: the IRIs of this fleet begin with {said or base_iri.DEFAULT}; "
            + (f"give --base {said}" if said else "leave --base away")
            + ", or another --out"
        )
    known = {place for one in there for place in one.sets.data_sets}
    new = [place for place in places if place not in known]
    share = max(1, min(size, -(-len(new) // max(workers, 1))))
    for number, start in enumerate(range(0, len(new), share), start=len(there) + 1):
        Batch.create(folder / _NAME.format(number), kind, new[start : start + share], base)


def batches_of(folder: Path) -> list[Batch]:
    """Return the batches in a fleet's folder."""
    return [Batch(inside(folder, file.parent.name)) for file in sorted(folder.glob("*/sets.json"))]


def status_of(batches: Sequence[Batch]) -> FleetStatus:
    """Count what became of the data sets of some batches."""
    counts: Counter[str] = Counter()
    aside = []
    for record in _records(batches):
        state = record.state if record is not None and record.final else "left"
        counts[state] += 1
        if record is not None and state in (REFUSED, FAILED):
            aside.append(record)
    return FleetStatus(counts, tuple(aside))


def _records(batches: Sequence[Batch]) -> Iterator[Record | None]:
    for one in batches:
        yield from one.records()


def _line(counts: Counter[str]) -> str:
    return ", ".join(f"{counts[state]} {state}" for state in (DONE, REFUSED, FAILED, "left") if counts[state])
