"""Motions with as much noise of positions once more: what that changes is what the noise of the log itself does."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from irtwin.gap.data.noise_floor import white_noise
from irtwin.gap.thresholds import Data
from irtwin.robot.description import Robot
from irtwin.signals.conditioning import condition_for_fit
from irtwin.signals.log import Run
from irtwin.signals.motion import Motion

_ENOUGH = 20_000  # samples: its products are then known within some percent


def shaken(
    runs: Sequence[Run], motions: Mapping[str, Motion], robot: Robot, limits: Data
) -> tuple[tuple[Motion, Motion], ...]:
    """Return observed runs' motions, each with the same of positions and speeds to which their noise was added again.

    The noise is white, as large as what the filter takes away says; runs that were smoothed before they were logged
    tell none. So many runs as make `_ENOUGH` samples, if there are.
    """
    random = np.random.default_rng(0)
    found: list[tuple[Motion, Motion]] = []
    for run in (run for run in runs if run.role == "observed"):
        motion = motions[run.name]
        again = _shaken(run, motion, robot, limits, random)
        if again is not None:
            found.append((motion, again))
        if sum(len(one.time) for one, _ in found) >= _ENOUGH:
            break
    return tuple(found)


def _shaken(run: Run, motion: Motion, robot: Robot, limits: Data, random: np.random.Generator) -> Motion | None:
    noisy = {}
    for name in ("q", "dq", "ddq"):
        signal = getattr(run.signals, name)
        variance = white_noise(run.signals.time, signal, motion, limits)
        if variance is not None and np.nansum(variance) > 0:
            noisy[name] = signal + random.standard_normal(signal.shape) * np.sqrt(np.nan_to_num(variance))
    if not noisy:
        return None
    assert motion.cutoff is not None
    again = condition_for_fit(replace(run, signals=replace(run.signals, **noisy)), robot, motion.cutoff)
    return replace(motion, q=again.q, dq=again.dq, ddq=again.ddq)
