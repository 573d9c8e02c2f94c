"""A run that the virtual robot performs, and what of it a page carries."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from irtwin.packing import base64_text, pack

_FRAME_RATE = 25.0  # Hz
_MOST_FRAMES = 12_000  # of the run shown first, eight minutes; a longer one is shown at a lower rate
_BUDGET = 400_000  # samples of all other runs together: 1.1 MB of page
_FEWEST = 50  # frames


@dataclass(frozen=True)
class Performance:
    """What a robot of n joints did, or is to do.

    time: (N,) s, rising; q: (N, n) rad or m; energy: (N,) J used so far; power: (N,) W; torque: (N, n) N m or N,
    NaN where none was modelled, None where none was at all.
    """

    name: str
    time: np.ndarray
    q: np.ndarray
    energy: np.ndarray
    power: np.ndarray
    torque: np.ndarray | None = None

    def check(self, joints: int) -> None:
        """Raise ValueError where the arrays do not fit together, or hold values that are not finite."""
        count = len(self.time)
        shapes = {"time": (count,), "q": (count, joints), "energy": (count,), "power": (count,)}
        for name, shape in (shapes | {"torque": (count, joints)}).items():
            values = getattr(self, name)
            if values is None:
                continue
            if values.shape != shape:
                raise ValueError(f"{self.name}: {name} has the shape {values.shape}, not {shape}")
            if name in shapes and not np.isfinite(values).all():
                raise ValueError(f"{self.name}: {name} holds values that are not finite")
        if count < 2 or not (np.diff(self.time) > 0).all():
            raise ValueError(f"{self.name}: time does not rise over at least two samples")

    def frames(self, most: int) -> dict[str, Any]:
        """Return the signals at even frames, packed, at most `most` of them.

        Power is the mean over a frame, so that no peak falls between two; energy keeps seven digits.
        """
        time = self.time
        length = float(time[-1] - time[0])
        count = int(np.clip(round(length * _FRAME_RATE) + 1, 2, most))
        frames = np.linspace(time[0], time[-1], count)
        step = length / (count - 1)
        edges = np.clip(np.concatenate([frames - step / 2, frames[-1:] + step / 2]), time[0], time[-1])
        work = np.concatenate([[0.0], np.cumsum((self.power[1:] + self.power[:-1]) / 2 * np.diff(time))])
        return {
            "name": self.name,
            "start": float(time[0]),
            "step": step,
            "q": [pack(np.interp(frames, time, column)) for column in self.q.T],
            "torque": None
            if self.torque is None
            else [pack(np.interp(frames, time, column)) for column in self.torque.T],
            "energy": base64_text(np.interp(frames, time, self.energy).astype("<f4")),
            "power": pack(np.diff(np.interp(edges, time, work)) / np.diff(edges)),
        }


def packed_runs(runs: Sequence[Performance], opens: int) -> list[dict[str, Any]]:
    """Return the frames of runs: the one at `opens` in full, the others at a rate at which all of them stay small."""
    columns = 2 * runs[opens].q.shape[1] + 3  # energy takes two
    wanted = sum(run.time[-1] - run.time[0] for place, run in enumerate(runs) if place != opens) * _FRAME_RATE
    share = min(1.0, _BUDGET / columns / max(wanted, 1.0))
    packed = []
    for place, run in enumerate(runs):
        frames = share * _FRAME_RATE * float(run.time[-1] - run.time[0])
        packed.append(run.frames(_MOST_FRAMES if place == opens else max(_FEWEST, round(frames) + 1)))
    return packed
