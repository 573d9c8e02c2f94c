"""What a twin says of a run: torque and power, sample by sample."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa

from irtwin.signals.channels import CHANNELS
from irtwin.signals.conditioning import condition
from irtwin.signals.log import Run, payload_told, run_of, topics_told
from irtwin.signals.samples import read_signals
from irtwin.signals.sampling import as_sampled
from irtwin.twin.twin import Twin


def read_motion(
    twin: Twin, file: Path, payload_mass: float | None = None, payload_com: tuple[float, float, float] | None = None
) -> Run:
    """Read a run of the twin's robot, of which the motion is enough.

    payload_mass kg, payload_com m in the flange frame: what the controller was told; None takes it from the data set
    that lists the file. Raises InputError on a file that is no run of the robot.
    """
    signals, _ = read_signals(file, twin.robot, measured=False, topics=topics_told(file, twin.robot))
    mass, com = payload_told(file) if payload_mass is None or payload_com is None else (0.0, (0.0, 0.0, 0.0))
    return run_of(
        file.stem,
        signals,
        file=file,
        payload_mass=mass if payload_mass is None else payload_mass,
        payload_com=com if payload_com is None else payload_com,
    )


def predict(twin: Twin, run: Run) -> pa.Table:
    """Return time (s), `tau_J` (N m) of each joint and `power` (W) that a twin predicts for a run's motion.

    One row per sample of the run, as it was logged, less those between holes in time that follow each other too soon;
    power only where the twin has an effect of it. Raises InputError on a run that has nothing but holes.
    """
    pieces, _ = as_sampled(run.signals, run.file)
    return pa.concat_tables([_piece(twin, replace(run, signals=piece), run.signals.time) for piece in pieces])


def _piece(twin: Twin, run: Run, logged: np.ndarray) -> pa.Table:
    """Predict a run without holes, at those of the logged times (N,) that lie in it."""
    motion = condition(run, twin.robot, twin.cutoff)
    beyond = 2 / motion.rate  # a hole is longer, what stands after the last update of held positions shorter
    time = logged[(logged >= motion.time[0]) & (logged < motion.time[-1] + beyond)]
    columns = {"time": time}
    for joint, values in zip(twin.robot.joint_names, twin.torque(motion).T, strict=True):
        columns[CHANNELS["torque"].column(joint)] = np.interp(time, motion.time, values)
    if any(effect.channel == "power" for effect, _ in twin.stack.power_terms):
        columns[CHANNELS["power"].prefix] = np.interp(time, motion.time, twin.power(motion))
    return pa.table(columns)
