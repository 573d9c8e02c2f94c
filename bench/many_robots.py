"""What one more data set costs, the more robots a workspace holds: `python bench/many_robots.py [ROBOTS]`.

Each robot is a synthetic arm of two joints with three runs of 8 s, taken in by `workflow.run`. Prints the seconds of
the processor that each further robot takes, those of Java too once it has ended, all told and step by step, the sizes
of the workspace, and the ratio of the last five to the first five; the very first is left out, as it loads the
ontology and starts Java.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))
from tests import small_robots

from irtwin import workflow

SHOWN = (1, 2, 5, 10, 20, 35, 50, 75, 100)


def main(robots: int) -> None:
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        seconds = [one_more(folder, number, number in SHOWN or number == robots) for number in range(1, robots + 1)]
        sizes = {
            kind: sum(file.stat().st_size for file in (folder / "workspace").glob(pattern)) / 2**20
            for kind, pattern in (("graph", "graph/*"), ("database", "irtwin.db*"), ("reports", "reports/*"))
        }
    print(", ".join(f"{kind} {size:.1f} MB" for kind, size in sizes.items()))
    early, late = statistics.median(seconds[1:6]), statistics.median(seconds[-5:])
    print(f"robots 2 to 6: {early:.1f} s, the last five: {late:.1f} s, ratio {late / early:.2f}")


def one_more(folder: Path, number: int, shown: bool) -> float:
    data_set = small_robots.data_set(folder / f"data_{number}", f"Robot_{number}", seed=number)
    steps: list[tuple[str, float]] = []
    began = spent()
    workflow.run(data_set, folder / "workspace", announce=lambda line: steps.append((line[10:].strip(), spent())))
    ended = spent()
    if shown:
        times = [at for _, at in steps] + [ended]
        parts = ((what, end - at) for (what, at), end in zip(steps, times[1:], strict=True))
        said = ", ".join(f"{what.split(',')[0][:28]} {took:.1f}" for what, took in parts if took > 0.2)
        print(f"{number:4d} robots: {ended - began:5.1f} s: {said}", flush=True)
    return ended - began


def spent() -> float:
    """Return the processor seconds of this process and of those that it started and that have ended."""
    return sum(os.times()[:4])


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 100)
