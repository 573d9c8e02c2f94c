"""How long windows of a long series take by SPARQL.

python bench/series.py [SAMPLES]      10^7 if not given
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow as pa

from irtwin.knowledge.store.graph import KnowledgeGraph
from irtwin.storage.series import write_series

FACTS = """PREFIX irt: <https://w3id.org/irtwin#> INSERT DATA {{ GRAPH <urn:g> {{
  <urn:series> irt:series_of <urn:run> ; irt:Series_Kind "measured" ; irt:File "{path}" }} }}"""


def least(work: Callable[[], object], times: int = 7) -> float:
    """Return the least time that work takes, ms."""
    taken = []
    for _ in range(times):
        began = time.perf_counter()
        work()
        taken.append(time.perf_counter() - began)
    return 1000 * min(taken)


def main(samples: int) -> None:
    moment = np.arange(samples) * 0.001
    draw = np.random.default_rng(0)
    channels = {f"q_joint_a{joint}": np.sin(moment * joint) for joint in range(1, 7)}
    table = pa.table({"time": moment, **channels, "power": 300 + draw.normal(size=samples)})
    end = moment[-1]
    with tempfile.TemporaryDirectory() as folder, KnowledgeGraph(workspace=Path(folder)) as graph:
        began = time.perf_counter()
        path, _ = write_series(Path(folder), table)
        print(f"{samples} samples of 7 channels written in {time.perf_counter() - began:.1f} s")
        graph.update(FACTS.format(path=path))
        for call in ("integral", "mean", "max"):
            for name, window in (("nearly all of it", (0.01 * end, 0.99 * end)), ("60 s", (0.5 * end, 0.5 * end + 60))):
                text = f"SELECT (series:{call}(<urn:run>, 'power', {window[0]}, {window[1]}) AS ?value) {{}}"
                assert graph.query(text)[0]["value"] is not None
                print(f"series:{call} over {name}: {least(lambda text=text: graph.query(text)):.1f} ms")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 10_000_000)
