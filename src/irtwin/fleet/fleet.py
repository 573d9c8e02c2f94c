"""A fleet: batches of data sets in one folder, made, worked on and counted."""

from __future__ import annotations

import subprocess
import sys
import threading
import time
from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from irtwin.announce import Announce
from irtwin.errors import InputError
from irtwin.fleet.batch import DONE, FAILED, REFUSED, STOPPED, Batch, Record
from irtwin.input_file import read_text
from irtwin.storage import base_iri
from irtwin.storage.files import inside

_NAME = "batch_{:04d}"
_FILE = "dataset.toml"
_LONGEST = 100_000_000  # bytes of a list: a million places
_WORKER = (sys.executable, "-m", "irtwin.fleet")
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
    announce: Announce = lambda line: None,
) -> FleetStatus:
    """Take every data set of a source through `run` or `diagnose`, results below `folder`.

    What was done before and has not changed is not done again. `batch`: at most so many data sets share a workspace;
    `base`: what the IRIs of its individuals begin with, one for the whole fleet; it is remembered.
    Raises InputError where the source holds none, or the folder is of another kind or base.
    """
    base = None if base is None else base_iri.checked(base, "--base")
    _plan(find_data_sets(source), folder, kind, batch, workers, base)
    batches = [planned for planned in batches_of(folder) if planned.sets.kind == kind]
    ended = count(1)

    def tell(done: Batch) -> None:
        announce(f"{done.folder.name}, {next(ended)} of {len(batches)}: {_line(status_of([done]).counts)}")

    with told_meanwhile(lambda: announce(f"  {_line(status_of(batches).counts)}")):
        work_through(batches, workers, tell)
    return status_of(batches)


def find_data_sets(source: Path) -> list[str]:
    """Return the folders of data sets, sorted.

    `source` is a folder (every folder below that has a dataset.toml), or a text file with one folder a line. Raises
    InputError where there is none.
    """
    places = [file.parent for file in source.rglob(_FILE)] if source.is_dir() else _listed(source)
    if not places:
        raise InputError(f"{source}: holds no data set; a data set is a folder with {_FILE}")
    return sorted({str(place.resolve()) for place in places})


def _listed(source: Path) -> list[Path]:
    places = []
    for number, line in enumerate(read_text(source, _LONGEST).splitlines(), start=1):
        place = line.strip()
        if not place or place.startswith("#"):
            continue
        if not (source.parent / place / _FILE).is_file():
            raise InputError(f"{source}, line {number}: {place} holds no {_FILE}")
        places.append(source.parent / place)
    return places


def work_through(
    batches: Sequence[Batch], workers: int, tell: Callable[[Batch], None], command: Sequence[str] = _WORKER
) -> None:
    """Work on batches on this machine, `workers` at once; `tell` is called as each ends. `command`: as `in_process`."""
    with ThreadPoolExecutor(workers) as pool:  # each thread waits for a process
        own = {pool.submit(in_process, str(batch.folder), command): batch for batch in batches}
        for future in as_completed(own):
            future.result()
            tell(own[future])


def in_process(folder: str, command: Sequence[str] = _WORKER) -> None:
    """Work through a batch in a process of its own, begun again where it dies; a store is bound to one thread.

    Each death counts against the data set that it died of. Raises InputError where a process dies without a record,
    or stops as the batch's folder cannot be written.
    """
    batch = Batch(Path(folder))
    before = list(batch.records())
    while (done := subprocess.run([*command, folder], stderr=subprocess.PIPE, text=True, check=False)).returncode != 0:
        if done.returncode == STOPPED:
            raise InputError(done.stderr.strip())
        sys.stderr.write(done.stderr)
        after = list(batch.records())
        if after == before:
            raise InputError(
                f"{folder}: its process ended with status {done.returncode} and left no record; see what it wrote"
            )
        before = after
    sys.stderr.write(done.stderr)


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


def _plan(places: Sequence[str], folder: Path, kind: str, size: int, workers: int, base: str | None) -> None:
    """Put data sets that no batch has into new ones, enough for each worker to have one."""
    batches = batches_of(folder)
    if batches and {batch.sets.kind for batch in batches} != {kind}:
        raise InputError(f"{folder}: holds a fleet of `{batches[0].sets.kind}`; give `{kind}` a folder of its own")
    if batches and {batch.sets.base for batch in batches} != {base}:
        own_base = batches[0].sets.base
        raise InputError(
            f"{folder}: the IRIs of this fleet begin with {own_base or base_iri.DEFAULT}; "
            + (f"give --base {own_base}" if own_base else "leave --base away")
            + ", or another --out"
        )
    known = {place for batch in batches for place in batch.sets.data_sets}
    new = [place for place in places if place not in known]
    share = max(1, min(size, -(-len(new) // max(workers, 1))))
    for number, start in enumerate(range(0, len(new), share), start=len(batches) + 1):
        Batch.create(folder / _NAME.format(number), kind, new[start : start + share], base)


def batches_of(folder: Path) -> list[Batch]:
    """Return the batches in a fleet's folder."""
    return [Batch(inside(folder, file.parent.name)) for file in sorted(folder.glob("*/sets.json"))]


def status_of(batches: Sequence[Batch]) -> FleetStatus:
    """Count what became of the data sets of some batches."""
    counts: Counter[str] = Counter()
    aside = []
    for record in (record for batch in batches for record in batch.records()):
        state = record.state if record is not None and record.final else "left"
        counts[state] += 1
        if record is not None and state in (REFUSED, FAILED):
            aside.append(record)
    return FleetStatus(counts, tuple(aside))


def _line(counts: Counter[str]) -> str:
    return ", ".join(f"{counts[state]} {state}" for state in (DONE, REFUSED, FAILED, "left") if counts[state])
