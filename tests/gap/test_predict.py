"""A saved twin says what a run takes."""

from __future__ import annotations

import numpy as np
import pyarrow as pa
import pyarrow.parquet

from irtwin.gap.predict import predict
from irtwin.twin.files import save
from irtwin.twin.identify import identify
from synthetic import arm, measure, swing


def test_a_saved_twin_predicts_a_run(tmp_path):
    robot = arm(2)
    twin = identify(robot, [measure(robot, swing(robot, seed, seconds=10.0)) for seed in (1, 2)])
    save(twin, tmp_path / "twin.json")
    new = measure(robot, swing(robot, 3, seconds=10.0))
    columns = {"time": new.time} | {f"q_{j}": new.q[:, k] for k, j in enumerate(robot.joint_names)}
    columns |= {f"tau_{j}": new.torque[:, k] for k, j in enumerate(robot.joint_names)}
    pa.parquet.write_table(pa.table(columns), tmp_path / "run.parquet")
    predict(tmp_path / "twin.json", tmp_path / "run.parquet", tmp_path / "out.parquet")
    found = pa.parquet.read_table(tmp_path / "out.parquet")
    assert found.column_names == ["time", "tau_joint_1", "tau_joint_2", "power"]
    error = found["tau_joint_1"].to_numpy() - new.torque[:, 0]
    assert np.median(np.abs(error)) < 0.02 * new.torque[:, 0].std()
