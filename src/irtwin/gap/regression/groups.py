"""Groups of runs that are left out together: those of one programmed motion."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from irtwin.identification.accumulate import Block

FEWEST_GROUPS = 4  # groups, two in each half
_GROUPS = 8  # of time, where the runs are fewer


@dataclass(frozen=True)
class Grouping:
    """Which runs are left out together: `label` of each run's programmed motion; `observed` runs' names.

    Programmed motions are cut in time where they are fewer than `FEWEST_GROUPS`.
    """

    label: dict[str, str]
    observed: frozenset[str]

    def few(self, runs: Iterable[str]) -> bool:
        """Return whether the programmed motions of these runs are too few to leave each out in turn."""
        return len({self.label[run] for run in runs if run in self.observed}) < FEWEST_GROUPS

    def of(self, blocks: Sequence[Block]) -> tuple[np.ndarray, np.ndarray]:
        """Return (B,) each block's group and whether it is observed; few runs are cut into stretches of time."""
        observed = np.array([block.run in self.observed for block in blocks])
        labels = [(block.run in self.observed, self.label[block.run]) for block in blocks]
        if self.few(block.run for block in blocks):
            labels = [(*label, k) for label, k in zip(labels, _stretches(blocks), strict=True)]  # type: ignore[misc]
        order = {label: k for k, label in enumerate(dict.fromkeys(labels))}
        return np.array([order[label] for label in labels]), observed


def _stretches(blocks: Sequence[Block]) -> list[int]:
    count = {run: sum(block.run == run for block in blocks) for run in {block.run for block in blocks}}
    per_run = max(2, -(-_GROUPS // len(count)))
    seen: dict[str, int] = {}
    stretches = []
    for block in blocks:
        k = seen.get(block.run, 0)
        seen[block.run] = k + 1
        stretches.append(k * min(per_run, count[block.run]) // count[block.run])
    return stretches
