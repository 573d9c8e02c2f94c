"""Uses a package whose table of channels has one more, `vibration`: prints each thing that it then can do.

Run by `test_channels.py`, in a process of its own.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
from tests.synthetic import arm, as_run, measure, swing

import irtwin
from irtwin.errors import InputError
from irtwin.live import live_run
from irtwin.live.joint_stream import StateReader
from irtwin.providers.records import ingest, load_run
from irtwin.signals.channels import CHANNELS, columns_of
from irtwin.signals.conditioning import condition
from irtwin.signals.log import DataSet, Run
from irtwin.signals.samples import read_signals
from irtwin.storage.database import Workspace
from irtwin.storage.journal import Header
from irtwin.storage.windows import SeriesWindows

ROBOT = arm(2)
JOINTS = ROBOT.joint_names


def main(folder: Path) -> None:
    folder.mkdir()
    assert Path(irtwin.__file__).is_relative_to(folder.parent)
    run = as_run(measure(ROBOT, swing(ROBOT, 1, seconds=6.0)))
    vibration = np.column_stack([np.sin(run.signals.time), np.cos(run.signals.time)])
    columns = columns_of(run.signals, JOINTS)
    columns |= {f"vib_{joint}": vibration[:, place] for place, joint in enumerate(JOINTS)}
    pyarrow.csv.write_csv(pa.table(columns), folder / "swing.csv")
    pyarrow.parquet.write_table(pa.table(columns), folder / "swing.parquet")
    for kind in ("csv", "parquet"):
        run = read(folder / f"swing.{kind}", run)
        assert np.array_equal(run.signals.vibration, vibration)
        print(kind)
    check(folder, columns)
    motion = condition(run, ROBOT, 5.0)
    assert motion.part(100, 300).vibration.shape == (200, 2)
    assert np.allclose(motion.vibration[50:-50], vibration[50:-50], atol=1e-3)
    print("conditioned")
    store(folder / "workspace", run)
    stream()


def read(path: Path, run: Run) -> Run:
    return replace(run, signals=read_signals(path, ROBOT)[0], file=path)


def check(folder: Path, columns: dict[str, np.ndarray]) -> None:
    greatest = CHANNELS["vibration"].greatest
    high = columns["vib_joint_2"].copy()
    high[7] = 2 * greatest
    without = {name: values for name, values in columns.items() if name != "vib_joint_2"}
    for said, wrong in (
        (f"row 7, column vib_joint_2: is beyond {greatest:g}", columns | {"vib_joint_2": high}),
        ("column vib_joint_2 is missing; log vib_ for every moving joint or for none", without),
    ):
        pyarrow.parquet.write_table(pa.table(wrong), folder / "wrong.parquet")
        try:
            read_signals(folder / "wrong.parquet", ROBOT)
        except InputError as error:
            assert said in str(error), error
        else:
            raise AssertionError(said)
    print("checked")


def store(folder: Path, run: Run) -> None:
    with Workspace(folder) as workspace:
        ingest(workspace, DataSet(Path(), ROBOT, (run,), None, None, "mains", True, {}))
        again = load_run(workspace, ROBOT, f"{ROBOT.name}.{run.name}")
        assert np.array_equal(again.signals.vibration, run.signals.vibration)
        print("stored")
        (file,) = (folder / "series").iterdir()
        mean = SeriesWindows(file).mean("vib_joint_1", 0.0, 6.0)
        assert np.isclose(mean, run.signals.vibration[:, 0].mean())
        print("asked")


def stream() -> None:
    reader = StateReader({"R": JOINTS})
    lines = (
        b'{"robot": "R", "time": 1.0, "position": [0.1, 0.2], "vibration": [3.0, 4.0]}',
        b'{"robot": "R", "time": 1.5, "position": [0.1, 0.2], "vibration": [5.0, 6.0]}',
    )
    states = [reader.read(line) for line in lines]
    assert states[0].of("vibration") == (3.0, 4.0)
    header = Header("R.live_1", "R", 0.0, live_run.columns(JOINTS))
    _, series = live_run.closed_rows(header, live_run.journal_rows(states), {})
    assert series.column("vib_joint_2").to_pylist() == [4.0, 6.0]
    print("streamed")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
