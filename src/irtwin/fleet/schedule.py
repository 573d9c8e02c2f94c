"""Who works on batches: processes of this machine, or the workers of a Dask cluster."""

from __future__ import annotations

import multiprocessing
from collections import deque
from collections.abc import Callable, Sequence
from multiprocessing.connection import wait
from multiprocessing.context import SpawnProcess
from pathlib import Path

from irtwin.errors import InputError
from irtwin.fleet.batch import Batch

Tell = Callable[[Batch], None]
_CONNECT = 10.0  # s until a scheduler has answered


def work_here(batches: Sequence[Batch], workers: int, tell: Tell) -> None:
    """Work on batches by processes of this machine, `workers` at once; `tell` is called as each batch ends.

    A batch whose process died is begun again, as its records say what it died of.
    """
    context = multiprocessing.get_context("spawn")  # a fork would share the store's threads
    waiting, running = deque(batches), list[tuple[SpawnProcess, Batch]]()
    try:
        while waiting or running:
            while waiting and len(running) < workers:
                process = context.Process(target=_work, args=(str(waiting[0].folder),), daemon=True)
                process.start()
                running.append((process, waiting.popleft()))
            wait([process.sentinel for process, _ in running])
            for process, batch in [one for one in running if one[0].exitcode is not None]:
                running.remove((process, batch))
                waiting.extend(_again(batch, process.exitcode != 0))
                tell(batch)
    finally:
        for process, _ in running:
            process.kill()


def work_on_cluster(batches: Sequence[Batch], scheduler: str, tell: Tell) -> None:
    """Work on batches by a Dask cluster, whose workers see the batches' folders; `scheduler` is its address.

    Nothing but a batch's path goes to a worker, and nothing comes back.
    """
    try:
        from distributed import Client, KilledWorker, as_completed
    except ModuleNotFoundError:
        raise InputError('a Dask cluster needs distributed; pip install "irtwin[fleet]"') from None
    try:
        client = Client(scheduler, timeout=_CONNECT)
    except (OSError, ValueError) as error:
        raise InputError(
            f"{scheduler}: no Dask scheduler answers ({error}); give its address, tcp://host:8786"
        ) from None
    with client:
        own = {client.submit(_work, str(batch.folder), pure=False): batch for batch in batches}
        ending = as_completed(list(own))
        for future in ending:
            batch = own.pop(future)
            failure = future.exception()
            if failure is not None and not isinstance(failure, KilledWorker):
                raise failure
            for again in _again(batch, failure is not None):
                new = client.submit(_work, str(again.folder), pure=False)
                own[new] = again
                ending.add(new)
            tell(batch)


def _again(batch: Batch, died: bool) -> list[Batch]:
    """Return the batch if a process died on it; each death counts against the data set that it died of."""
    if not died:
        return []
    if not any(record is not None for record in batch.records()):
        raise InputError(f"{batch.folder}: its process ended before it began; see what it wrote above")
    return [batch]


def _work(folder: str) -> None:
    Batch(Path(folder)).work()
