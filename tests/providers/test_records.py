"""What is taken in is given back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from irtwin.errors import InputError
from irtwin.providers.records import ingest, load_robot, load_run
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.log import DataSet, Run
from irtwin.signals.samples import Signals
from irtwin.storage.database import Workspace

URDF = """<robot name="one"><link name="base"/><link name="l1"/>
  <joint name="a" type="continuous"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/></joint></robot>"""


def run(name: str = "first", **changes: object) -> Run:
    time = np.linspace(0.0, 1.0, 30)
    signals = Signals(time, np.sin(time)[:, None], torque=np.cos(time)[:, None], power=time * 10)
    made = Run(name, Path(f"{name}.csv"), "0" * 64, "observed", 1.5, (0.0, 0.1, 0.2), None, None, {}, signals)
    return replace(made, **changes)  # type: ignore[arg-type]


def data_set(*runs: Run) -> DataSet:
    robot = parse_urdf(URDF)
    joints = (replace(robot.joints[0], gear_ratio=50.0),)
    robot = replace(robot, name="One arm", joints=joints, weight=3.0)
    return DataSet(Path(), robot, runs, ("rigid_body",), 21.0, "mains", True, {"note": "kept"})


def test_a_data_set_comes_back_as_it_was(tmp_path):
    first = run()
    second = run("second", repeat_of="first")
    with Workspace(tmp_path) as workspace:
        assert ingest(workspace, data_set(second, first)) == "new"
        assert ingest(workspace, data_set(second, first)) == "unchanged"
        robot = load_robot(workspace, "One_arm")
        assert robot == replace(data_set(first).robot)
        back = load_run(workspace, robot, "One_arm.second")
    assert (back.name, back.payload_mass, back.payload_com, back.repeat_of) == ("second", 1.5, (0.0, 0.1, 0.2), "first")
    assert np.array_equal(back.signals.q, first.signals.q)
    assert np.array_equal(back.signals.torque, first.signals.torque)
    assert np.array_equal(back.signals.power, first.signals.power)
    assert back.signals.dq is None


def test_names_that_collide_as_identifiers_are_refused(tmp_path):
    with Workspace(tmp_path) as workspace, pytest.raises(InputError, match="differ in punctuation alone"):
        ingest(workspace, data_set(run("a b"), run("a.b")))
