"""What a data set has to hold so that its gap can be diagnosed at all."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from irtwin.errors import InputError
from irtwin.signals.channels import CHANNELS
from irtwin.signals.conditioning import STANDSTILL
from irtwin.signals.log import DataSet, Run
from irtwin.signals.motion import Motion

_TORQUE, _CURRENT = CHANNELS["torque"], CHANNELS["current"]


def admit(data_set: DataSet, motions: Mapping[str, Motion], shortest: float) -> None:
    """Raise InputError, naming the file and what to do, where no diagnosis is possible; `motions` by name of the run.

    There have to be observed runs, together no shorter than `shortest`, s, with torque or power that changes with the
    motion, in which some joint moves; references that share a signal with them; and no run twice, which would judge a
    fit on what it was fitted to.
    """
    file = data_set.folder / "dataset.toml"
    observed = [run for run in data_set.runs if run.role == "observed"]
    if not observed:
        raise InputError(f'{file}: no run has role = "observed"; give that role to the runs to be diagnosed')
    seen = [motions[run.name] for run in observed]
    if not any(motion.torque is not None or motion.power is not None for motion in seen):
        raise InputError(f"{file}: {_nothing_measured(seen)}")
    seconds = sum(float(motion.time[-1] - motion.time[0]) for motion in seen)
    if seconds < shortest:
        raise InputError(
            f"{file}: the observed runs last {seconds:.2g} s together, too short to tell a gap from none; log at least "
            f"{shortest:g} s in motion"
        )
    moving = {run.name: _moving(motions[run.name]) for run in observed}
    if not any(joints.any() for joints in moving.values()):
        raise InputError(f"{file}: no joint moves in any observed run; log runs in motion")
    _check_dead([run for run in observed if moving[run.name].any()], data_set.robot.joint_names, moving)
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


def _moving(motion: Motion) -> np.ndarray:
    """Return (n,) which joints move: faster, and in all farther, than a joint that stands does in a second."""
    return np.asarray((np.abs(motion.dq).max(axis=0) > STANDSTILL) & (np.ptp(motion.q, axis=0) > STANDSTILL))


def _check_dead(runs: Sequence[Run], joints: Sequence[str], moving: Mapping[str, np.ndarray]) -> None:
    """Raise where the torque of a joint that moves, or power, is one and the same number throughout all runs.

    A fit to it would be perfect, and say that there is no gap.
    """
    powers = [run.signals.power for run in runs if run.signals.power is not None]
    if powers and all(np.ptp(power) == 0 for power in powers):
        raise _dead(runs[0], f"column {CHANNELS['power'].prefix}")
    for joint, name in enumerate(joints):
        moved = [run for run in runs if run.signals.torque is not None and moving[run.name][joint]]
        torques = [run.signals.torque[:, joint] for run in moved if run.signals.torque is not None]
        if torques and all(np.ptp(torque) == 0 for torque in torques):
            raise _dead(moved[0], f"the torque of {name}, by column {_TORQUE.column(name)} or {_CURRENT.column(name)},")


def _dead(run: Run, channel: str) -> InputError:
    return InputError(
        f"{run.file}: {channel} does not change, nor does it in any other run, though the robot moves: a dead channel; "
        "mend what measures it, or leave it out"
    )


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
        if first.get(run.sha256, run).file != run.file:  # a run in pieces is one file
            raise InputError(f"{run.file}: is a copy of {first[run.sha256].file}; leave one of them out")
        first[run.sha256] = run
