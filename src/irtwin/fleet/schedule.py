"""Who works on batches: processes of this machine."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from pathlib import Path

from irtwin.errors import InputError
from irtwin.fleet.batch import STOPPED, Batch

Tell = Callable[[Batch], None]
WORKER = (sys.executable, "-m", "irtwin.fleet")


def work_through(batches: Sequence[Batch], workers: int, tell: Tell, command: Sequence[str] = WORKER) -> None:
    """Work on batches on this machine, `workers` at once; `tell` is called as each ends. `command`: as `in_process`."""
    with ThreadPoolExecutor(workers) as pool:  # each thread waits for a process
        own = {pool.submit(in_process, str(batch.folder), command): batch for batch in batches}
        for future in as_completed(own):
            future.result()
            tell(own[future])


def in_process(folder: str, command: Sequence[str] = WORKER) -> None:
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
