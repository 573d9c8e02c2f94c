"""Groups of runs left out, and into how many blocks they are cut."""

from __future__ import annotations

from irtwin.gap.regression.groups import Grouping
from irtwin.identification.accumulate import BLOCKS


def grouping(motions: int) -> Grouping:
    runs = [f"run_{k}" for k in range(8)]
    return Grouping({run: f"motion_{k % motions}" for k, run in enumerate(runs)}, frozenset(runs), 4)


def test_runs_of_many_motions_are_cut_into_shorter_blocks_than_those_of_few():
    assert grouping(8).blocks(["run_0", "run_1", "run_2", "run_3"]) > BLOCKS
    assert grouping(2).blocks(["run_0", "run_1", "run_2", "run_3"]) == BLOCKS
