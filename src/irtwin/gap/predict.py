"""What a twin says of a run: torque and power as a Parquet file."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from irtwin.errors import InputError
from irtwin.signals.conditioning import condition
from irtwin.signals.log import Run
from irtwin.signals.samples import read_signals
from irtwin.twin.files import load
from irtwin.twin.twin import Twin


def predict(twin_file: Path, run_file: Path, out: Path) -> None:
    """Write time (s), `tau_J` (N m) of each joint and `power` (W) that a saved twin predicts for a run's motion.

    One row per sample of the run, as it was logged. Raises InputError on a file that is no twin or no run of its robot.
    """
    twin = load(twin_file)
    signals, _ = read_signals(run_file, twin.robot)
    run = Run(run_file.stem, run_file, "", "observed", 0.0, (0.0, 0.0, 0.0), None, None, {}, signals)
    motion = condition(run, twin.robot, twin.cutoff)
    columns = {"time": signals.time}
    torque = twin.torque(motion)
    for joint, values in zip(twin.robot.joint_names, torque.T, strict=True):
        columns[f"tau_{joint}"] = np.interp(signals.time, motion.time, values)
    if _has_power(twin):
        columns["power"] = np.interp(signals.time, motion.time, twin.power(motion))
    partial = out.with_name(out.name + ".part")
    try:
        pa.parquet.write_table(pa.table(columns), partial)
        partial.replace(out)
    except OSError as error:
        raise InputError(f"{out}: cannot be written ({error.strerror}); name a file in a folder that exists") from error


def _has_power(twin: Twin) -> bool:
    return any(effect.channel == "power" for effect, _ in twin.stack.power_terms)
