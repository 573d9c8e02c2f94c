"""What a data set has to hold so that its gap can be diagnosed at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from irtwin.errors import InputError
from irtwin.signals.log import DataSet, Run
from irtwin.signals.motion import Motion

_SLOW = 1e-3  # rad/s (m/s)
_STILL = 1e-3  # rad (m): noise of a joint that stands still spans less


def admit(data_set: DataSet, motions: Mapping[str, Motion]) -> None:
    """Raise InputError, naming the file and what to do, where no diagnosis is possible; `motions` by name of the run.

    There have to be observed runs, with torque or power, in which some joint moves; references that share a signal with
    them; and no run twice, which would judge a fit on what it was fitted to.
    """
    file = data_set.folder / "dataset.toml"
    observed = [run for run in data_set.runs if run.role == "observed"]
    if not observed:
        raise InputError(f'{file}: no run has role = "observed"; mark those whose gap is to be diagnosed')
    seen = [motions[run.name] for run in observed]
    if not any(motion.torque is not None or motion.power is not None for motion in seen):
        raise InputError(f"{file}: {_nothing_measured(seen)}")
    if not any(_moves(motion) for motion in seen):
        raise InputError(f"{file}: no joint moves in any observed run; log runs in motion")
    others = [run for run in data_set.runs if run.role != "observed"]
    if others and not _overlap(seen, [motions[run.name] for run in others]):
        raise InputError(
            f"{file}: the {others[0].role} runs share neither torque nor power with the observed runs; "
            "log one signal in both, or leave these runs out"
        )
    _check_copies(data_set.runs)


def _nothing_measured(motions: Sequence[Motion]) -> str:
    if any(motion.current is not None for motion in motions):
        return (
            "the observed runs have currents but no torque, and no power beside them that would tell the torque "
            "constants; give torque_constant for each joint, or log tau_"
        )
    return "neither torque nor power was measured in any observed run; log tau_, i_ or power"


def _moves(motion: Motion) -> bool:
    return bool(np.any((np.abs(motion.dq).max(axis=0) > _SLOW) & (np.ptp(motion.q, axis=0) > _STILL)))


def _overlap(observed: Sequence[Motion], others: Sequence[Motion]) -> bool:
    return any(
        any(getattr(motion, signal) is not None for motion in observed)
        and any(getattr(motion, signal) is not None for motion in others)
        for signal in ("torque", "power")
    )


def _check_copies(runs: Sequence[Run]) -> None:
    """Raise where two files of measured runs are the same; a simulator may well repeat itself."""
    first: dict[str, Run] = {}
    for run in runs:
        if run.role == "simulated" or not run.sha256:
            continue
        if run.sha256 in first:
            raise InputError(f"{run.file}: is a copy of {first[run.sha256].file}; leave one of them out")
        first[run.sha256] = run
