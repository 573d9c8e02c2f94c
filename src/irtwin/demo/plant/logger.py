"""The file that the logger of a run leaves."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq

from irtwin.demo.plant.simulate import PlantRecording


def write_run(file: Path, recording: PlantRecording, joints: list[str]) -> None:
    """Write one run; single precision holds every sensor's resolution but the clock's."""
    columns = {"time": pa.array(np.round(recording.time, 6))}
    for prefix, values in (("q", recording.q), ("tau", recording.torque), ("temp", recording.temperature)):
        for joint, column in zip(joints, values.T, strict=True):
            columns[f"{prefix}_{joint}"] = pa.array(column.astype(np.float32))
    columns["power"] = pa.array(recording.power.astype(np.float32))
    file.parent.mkdir(parents=True, exist_ok=True)
    pq.write_table(pa.table(columns), file, compression="zstd", compression_level=15, store_schema=False)
