"""A batch: some data sets of a fleet, worked through one after the other, and a record of what became of each."""

from __future__ import annotations

import fcntl
import hashlib
import json
import time
import traceback
from collections.abc import Iterator, Sequence
from dataclasses import asdict, astuple, dataclass
from functools import cached_property
from pathlib import Path

from irtwin import __version__
from irtwin.errors import InputError, WorkspaceFault
from irtwin.input_file import read_input
from irtwin.json_text import parse_json
from irtwin.storage.files import InsidePath, inside, locked, write

RUN, DIAGNOSE = "run", "diagnose"
BEGUN, DONE, REFUSED, FAILED = "begun", "done", "refused", "failed"
STOPPED = 2  # exit status of a process whose batch's folder cannot be written
_ATTEMPTS = 2  # of a data set whose process ended: memory may have been short for another's sake
_SETS = "sets.json"
_MOST_BYTES = 100_000_000


@dataclass(frozen=True)
class Record:
    """What became of a data set: `state`, and `said`, one line where it was refused or failed.

    `attempts`: how often it was begun since it last changed; `checksum`: of its files; `irtwin`: the version.
    """

    data_set: str
    state: str
    said: str = ""
    seconds: float = 0.0
    attempts: int = 1
    checksum: str = ""
    irtwin: str = __version__

    @property
    def final(self) -> bool:
        """Whether there is nothing more to try."""
        return self.state in (DONE, REFUSED, FAILED)


_USUAL = Record("", BEGUN)  # whose fields have their types


@dataclass(frozen=True)
class Sets:
    """What a batch is for, `run` or `diagnose`, and its data sets.

    `base`: what the IRIs of its workspace begin with, if said.
    """

    kind: str
    data_sets: list[str]
    base: str | None = None


@dataclass(frozen=True)
class Batch:
    """A folder of a fleet: `sets.json`, `records/`, and the results, a workspace or `diagnoses/`."""

    folder: Path

    @classmethod
    def create(cls, folder: Path, kind: str, places: Sequence[str], base: str | None = None) -> Batch:
        """Write down which data sets a new batch has, and what its IRIs begin with."""
        write(folder / _SETS, json.dumps(asdict(Sets(kind, list(places), base)), indent=1).encode())
        return cls(folder)

    @cached_property
    def sets(self) -> Sets:
        """What it was made of. Raises InputError where that cannot be read."""
        file = inside(self.folder, _SETS)
        try:
            sets = Sets(**parse_json(read_input(file, _MOST_BYTES)))
            if not isinstance(sets.data_sets, list) or sets.kind not in (RUN, DIAGNOSE):
                raise ValueError("it says no data sets, or not what for")
        except (ValueError, TypeError) as error:
            raise InputError(
                f"{file}: cannot be read ({error}); remove its folder, and its sets are taken again"
            ) from None
        return sets

    def record(self, place: str) -> Record | None:
        """Return what is known of a data set; None where it was never begun, or its record is damaged."""
        file = self._record_file(place)
        try:
            record = Record(**parse_json(read_input(file, _MOST_BYTES)))
        except (InputError, ValueError, TypeError):
            return None  # it is tried again
        sound = all(isinstance(own, type(usual)) for own, usual in zip(astuple(record), astuple(_USUAL), strict=True))
        return record if sound else None

    def records(self) -> Iterator[Record | None]:
        """Yield the record of each data set."""
        yield from map(self.record, self.sets.data_sets)

    def _record_file(self, place: str) -> InsidePath:
        return inside(self.folder, f"records/{key(place)}.json")

    def _write(self, record: Record) -> None:
        write(self._record_file(record.data_set), json.dumps(asdict(record), indent=1).encode())

    def work(self) -> None:
        """Take each data set through what the batch is for, but those that are done and have not changed.

        A data set that is refused or fails costs no other. Where the process ends, the next one goes on from there.
        """
        places = self.sets.data_sets
        with locked(self.folder, fcntl.LOCK_EX):  # the same command may be given twice
            for place in places:
                self._take(place)

    def _take(self, place: str) -> None:
        before, began = self.record(place), time.monotonic()
        attempts = 1
        try:
            now = checksum(Path(place))
            if before is not None and before.checksum == now and before.irtwin == __version__:
                if before.state in (DONE, REFUSED):
                    return
                attempts = before.attempts + 1 if before.state == BEGUN else 1
            if attempts > _ATTEMPTS:
                why = f"the process ended {_ATTEMPTS} times while it worked on this; memory may be short"
                return self._write(Record(place, FAILED, why, attempts=attempts, checksum=now))
            self._write(Record(place, BEGUN, attempts=attempts, checksum=now))
            state, why = self._done(place)
        except OSError as error:  # a disk that does not answer
            now, state, why = "", FAILED, str(error)
        self._write(Record(place, state, why, time.monotonic() - began, attempts, now))

    def _done(self, place: str) -> tuple[str, str]:
        """Return the state that a data set has come to, and what is to be said of it."""
        trace = inside(self.folder, f"records/{key(place)}.traceback.txt")
        trace.unlink(missing_ok=True)
        try:
            if self.sets.kind == RUN:
                from irtwin import workflow  # two seconds of imports, which a batch that is done can do without

                workflow.run(Path(place), inside(self.folder, "workspace"), base=self.sets.base)
            else:
                from irtwin import diagnosing

                results = inside(self.folder, f"diagnoses/{key(place)}")
                diagnosing.diagnose(Path(place), json_file=results / "gap.json", twin_file=results / "twin.json")
        except WorkspaceFault as error:  # no fault of the data set: the next call tries again
            return FAILED, str(error)
        except InputError as error:
            return REFUSED, str(error)
        except Exception as error:  # a bug in one costs no other; its traceback is kept
            write(trace, traceback.format_exc().encode())
            return FAILED, f"{type(error).__name__}, see {trace}"
        return DONE, ""


def key(place: str) -> str:
    """Return the name of a data set's files: its folder's, and what tells it from others of that name."""
    name = "".join(sign if sign.isalnum() or sign in "-_." else "_" for sign in Path(place).name)[:80]
    return f"{name}-{hashlib.sha256(place.encode()).hexdigest()[:8]}"


def checksum(data_set: Path) -> str:
    """Return the SHA-256 of a data set: of its files' names and bytes."""
    whole = hashlib.sha256()
    for file in sorted(path for path in data_set.rglob("*") if path.is_file()):
        whole.update(str(file.relative_to(data_set)).encode() + b"\0")
        with file.open("rb") as content:
            hashlib.file_digest(content, lambda: whole)
    return whole.hexdigest()
