"""How long `irtwin query` takes while another command writes: `python bench/query_beside_writer.py [QUERIES]`.

A small workspace is asked, the whole command from start to exit: alone, beside `irtwin run` (data sets of new robots,
one after the other), beside `irtwin live` (a robot at 83 Hz). Each line: median and greatest wall time, and the
processor time of the query. Beside each query an empty `python -c pass` is started: where the machine is shared, its
wall time tells what waiting for a processor costs. The same again with priority (nice -15), where that is allowed.
"""

from __future__ import annotations

import json
import os
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext, suppress
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests import small_robots

IRTWIN = [sys.executable, "-m", "irtwin"]
RATE = 83.0  # Hz
Taken = tuple[float, float]  # s of wall time, s of processor time


def main(queries: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        place = folder / "workspace"
        called("run", small_robots.data_set(folder / "First", "First"), "--workspace", place)
        others = [small_robots.data_set(folder / f"Robot_{k}", f"Robot_{k}", seed=k) for k in range(1, 8)]
        print(f"load {os.getloadavg()[0]:.1f} on {os.cpu_count()} processors; wall median, max; processor median (s)")
        for what, writer in (
            ("alone", nullcontext()),
            ("beside run", running(others, place)),
            ("beside live", watching(place)),
        ):
            with writer:
                for priority in (0, -15) if os.geteuid() == 0 else (0,):
                    report(f"{what}{', with priority' if priority else ''}", place, queries, priority)


def report(what: str, place: Path, queries: int, priority: int) -> None:
    query = [*IRTWIN, "query", "energy_per_run", "--workspace", str(place), "--format", "csv"]
    asked, empty = [], []
    for _ in range(queries):
        asked.append(timed(query, priority))
        empty.append(timed([sys.executable, "-c", "pass"], priority))
        time.sleep(0.1)
    print(f"{what}: query {summary(asked)}, empty {summary(empty)}, load {os.getloadavg()[0]:.1f}", flush=True)


def timed(command: list[str], priority: int) -> Taken:
    began = time.perf_counter()
    process = subprocess.Popen(["nice", "-n", str(priority), *command], stdout=subprocess.DEVNULL)
    _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    assert process.returncode == 0, command
    return time.perf_counter() - began, usage.ru_utime + usage.ru_stime


def summary(taken: list[Taken]) -> str:
    wall, processor = zip(*taken, strict=True)
    return f"{statistics.median(wall):.2f}, {max(wall):.2f}; {statistics.median(processor):.2f}"


@contextmanager
def running(data_sets: list[Path], place: Path) -> Iterator[None]:
    """Take data sets in, over and over, until the block ends."""
    over = threading.Event()

    def work() -> None:
        while not over.is_set():
            for data_set in data_sets:
                if not over.is_set():
                    called("run", data_set, "--workspace", place)
            for data_set in data_sets:
                if not over.is_set():
                    called("workspace", "drop", data_set.name, "--workspace", place)

    with in_background(work):
        yield
        over.set()


@contextmanager
def watching(place: Path) -> Iterator[None]:
    """Watch a robot until the block ends."""
    process = subprocess.Popen([*IRTWIN, "live", "--workspace", str(place)], stdin=subprocess.PIPE, stderr=sys.stderr)
    stream = process.stdin
    assert stream is not None
    over = threading.Event()

    def work() -> None:
        with suppress(BrokenPipeError):
            while not over.wait(1.0 / RATE):
                said = {
                    "robot": "First",
                    "time": time.time(),
                    "position": [0.1, 0.2],
                    "effort": [1.0, 2.0],
                    "power": 99,
                }
                stream.write(json.dumps(said).encode() + b"\n")
                stream.flush()

    with in_background(work):
        yield
        over.set()
    stream.close()
    assert process.wait() == 0


@contextmanager
def in_background(work: Callable[[], None]) -> Iterator[None]:
    thread = threading.Thread(target=work)
    thread.start()
    yield
    thread.join()


def called(*arguments: object) -> None:
    subprocess.run([*IRTWIN, *map(str, arguments)], check=True, capture_output=True)


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 20)
