"""What a simulator's model says of the motions that a robot made, as runs of the simulator."""

from __future__ import annotations

from dataclasses import replace

from irtwin.errors import InputError
from irtwin.identification.cutoff import cutoff_for
from irtwin.identification.progress import Tell
from irtwin.input_file import checksum
from irtwin.signals.channels import Signals
from irtwin.signals.conditioning import condition_for_fit
from irtwin.signals.log import DataSet, Run
from irtwin.simulator.model import Model


def with_simulated_runs(data_set: DataSet, model: Model, tell: Tell | None = None) -> DataSet:
    """Return the data set with a simulated run beside each observed one: its motion, and the torque of the model.

    A model carries no payload; what the robot carried is known, and the twin has it.
    Raises InputError where the data set has simulated runs, or no torque was measured, or in some runs alone.
    """
    if any(run.role == "simulated" for run in data_set.runs):
        raise InputError(f"{data_set.folder}: has simulated runs of its own; leave these out, or the simulator's model")
    observed = [run for run in data_set.runs if run.role == "observed"]
    if not any(run.signals.torque is not None for run in observed):
        raise InputError(
            f"{data_set.folder}: no run has torque to hold the simulator against; log tau_JOINT or i_JOINT"
        )
    for run in data_set.runs:
        if not run.says_effort:
            raise InputError(f"{run.file}: has commands and no torque, where other runs have torque; leave it out")
    cutoff = cutoff_for(data_set.robot, observed, data_set.cutoff, tell)
    simulated = tuple(_simulated(run, data_set, model, cutoff.hz) for run in observed)
    return replace(data_set, runs=(*data_set.runs, *simulated))


def _simulated(run: Run, data_set: DataSet, model: Model, cutoff: float) -> Run:
    motion = condition_for_fit(run, data_set.robot, cutoff)
    torque = model.torque(motion.q, motion.dq, motion.ddq)
    return replace(
        run,
        name=f"{run.name} in {model.name}",
        file=model.file.path,
        sha256=checksum(model.file.path),
        role="simulated",
        payload_mass=0.0,
        payload_com=(0.0, 0.0, 0.0),
        repeat_of=None,
        performs=None,
        signals=Signals(motion.time, motion.q, dq=motion.dq, ddq=motion.ddq, torque=torque),
    )
