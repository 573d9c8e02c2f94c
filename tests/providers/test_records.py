"""What is taken in is given back."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

from irtwin.errors import InputError
from irtwin.providers.names import identifier
from irtwin.providers.records import ingest, load_robot, load_run
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.channels import Signals
from irtwin.signals.log import DataSet, Run
from irtwin.storage.database import Workspace
from irtwin.storage.schema import RunRow as Row

URDF = """<robot name="one"><link name="base"/><link name="l1"/>
  <joint name="a" type="continuous"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/></joint></robot>"""


def run(name: str = "first", **changes: object) -> Run:
    time = np.linspace(0.0, 1.0, 30)
    signals = Signals(time, np.sin(time)[:, None], torque=np.cos(time)[:, None], power=time * 10)
    made = Run(name, Path(f"{name}.csv"), "0" * 64, "observed", 1.5, (0.0, 0.1, 0.2), None, None, {}, signals)
    return replace(made, **changes)  # type: ignore[arg-type]


def data_set(*runs: Run) -> DataSet:
    robot = parse_urdf(URDF)
    joints = (replace(robot.joints[0], gear_ratio=50.0, acceleration=40.0),)
    robot = replace(robot, name="One arm", joints=joints, weight=3.0)
    return DataSet(Path(), robot, runs, ("rigid_body",), 21.0, "mains", True, {"note": "kept"})


def test_a_data_set_comes_back_as_it_was(database_url, tmp_path):
    first = run(started=datetime(2026, 3, 1, 13, 0, 0, 250_001, timezone(timedelta(hours=1))))
    second = run("second", repeat_of="first")
    with Workspace(tmp_path, database_url) as workspace:
        assert ingest(workspace, data_set(second, first)) == "new"
        assert ingest(workspace, data_set(second, first)) == "unchanged"
        robot = load_robot(workspace, identifier("One arm"))
        assert robot == replace(data_set(first).robot)
        back = load_run(workspace, robot, f"{identifier('One arm')}.second")
        said = workspace.row(Row, f"{identifier('One arm')}.first")
        unsaid = workspace.row(Row, f"{identifier('One arm')}.second")
    began = datetime(2026, 3, 1, 12, 0, 0, 250_001, UTC)
    assert (said.started, said.ended) == (began, began + timedelta(seconds=1))
    assert (unsaid.started, unsaid.ended, unsaid.start_time_from) == (None, None, "ingest")
    assert (back.name, back.payload_mass, back.payload_com, back.repeat_of) == ("second", 1.5, (0.0, 0.1, 0.2), "first")
    assert np.array_equal(back.signals.q, first.signals.q)
    assert np.array_equal(back.signals.torque, first.signals.torque)
    assert np.array_equal(back.signals.power, first.signals.power)
    assert back.signals.dq is None


def test_a_joint_that_has_lost_its_row_is_told(tmp_path):
    with Workspace(tmp_path) as workspace:
        ingest(workspace, data_set(run()))
        with workspace.engine.begin() as connection:
            connection.exec_driver_sql("DELETE FROM joint")
        with pytest.raises(InputError, match='no row of joint "a" of "One arm"; run its data set again, or restore'):
            load_robot(workspace, identifier("One arm"))
