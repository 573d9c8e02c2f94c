"""A saved twin says what a run takes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from tests.data_sets import irtwin, irtwin_does, irtwin_refuses, write
from tests.synthetic import arm, as_run, measure, rigid_torque, swing

from irtwin.effects.rigid_body import flange_frame
from irtwin.robot.model import inverse_dynamics
from irtwin.twin.files import to_json
from irtwin.twin.identify import identify

ROBOT = arm(2)
MASS, COM = 3.0, (0.02, -0.01, 0.1)


def loaded(motion):
    """The motion as measured with a payload of which the controller was told."""
    robot = ROBOT
    frame = flange_frame(robot)
    model = robot.model.copy()
    load = pin.Inertia(MASS, frame.placement.act(np.array(COM)), np.zeros((3, 3)))
    model.inertias[frame.parentJoint] += load
    added = inverse_dynamics(model, motion.q, motion.dq, motion.ddq) - rigid_torque(robot, motion)
    shown = measure(robot, motion)
    return replace(shown, torque=shown.torque + added, payload_mass=MASS, payload_com=COM)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A twin, and a data set whose runs it has not seen: bare, and with a payload."""
    place = tmp_path_factory.mktemp("predict")
    twin = identify(ROBOT, [measure(ROBOT, swing(ROBOT, seed, seconds=10.0)) for seed in (1, 2)])
    (place / "twin.json").write_text(to_json(twin))
    bare = as_run(replace(measure(ROBOT, swing(ROBOT, 3, seconds=10.0)), run="bare"))
    heavy = as_run(replace(loaded(swing(ROBOT, 4, seconds=10.0)), run="loaded"))
    write(place / "data", ROBOT, [bare, heavy])
    return place


def error(folder, run, *options):
    """The median error of the first joint's predicted torque, over its deviation."""
    out = folder / "out.parquet"
    irtwin_does("predict", folder / "twin.json", run, "--out", out, *options)
    found, measured = pq.read_table(out), pq.read_table(run)
    assert found.num_rows == measured.num_rows
    torque = measured["tau_joint_2"].to_numpy()
    return np.median(np.abs(found["tau_joint_2"].to_numpy() - torque)) / torque.std()


def test_a_saved_twin_predicts_a_run(folder):
    assert error(folder, folder / "data/runs/bare.parquet") < 0.02
    found = pq.read_table(folder / "out.parquet")
    assert found.column_names == ["time", "tau_joint_1", "tau_joint_2", "power"]


def test_the_payload_is_that_of_the_data_set_unless_told(folder):
    run = folder / "data/runs/loaded.parquet"
    assert error(folder, run) < 0.02
    assert error(folder, run, "--payload-mass", "0") > 0.1
    lonely = folder / "lonely.parquet"
    pq.write_table(pq.read_table(run), lonely)
    assert error(folder, lonely) > 0.1
    assert error(folder, lonely, "--payload-mass", MASS, "--payload-com", *COM) < 0.02


def test_the_motion_of_a_run_is_enough(folder, tmp_path):
    run = pq.read_table(folder / "data/runs/bare.parquet")
    pq.write_table(run.select(["time", "q_joint_1", "q_joint_2"]), tmp_path / "planned.parquet")
    with_torque, alone = tmp_path / "a.parquet", tmp_path / "b.parquet"
    irtwin("predict", folder / "twin.json", folder / "data/runs/bare.parquet", "--out", with_torque)
    assert irtwin("predict", folder / "twin.json", tmp_path / "planned.parquet", "--out", alone).status == 0
    assert pq.read_table(alone).equals(pq.read_table(with_torque))


def broken(folder, tmp_path, fault):
    """The arguments of a command that has one fault, and what is said of it."""
    twin, run, out = folder / "twin.json", tmp_path / "run.parquet", tmp_path / "out.parquet"
    table = pq.read_table(folder / "data/runs/bare.parquet")
    pq.write_table(table, run)
    if fault == "another robot":
        pq.write_table(table.rename_columns([n.replace("joint_2", "elbow") for n in table.column_names]), run)
        return (twin, run, "--out", out), 'run.parquet: column q_elbow: the robot has no moving joint "elbow"'
    if fault == "no twin":
        return (run, run, "--out", out), "name a twin that irtwin saved"
    if fault == "no run":
        return (twin, tmp_path / "nowhere.csv", "--out", out), "nowhere.csv: cannot be read"
    if fault == "a bad sample":
        q = np.array(table["q_joint_1"]).copy()
        q[17] = np.inf
        pq.write_table(table.set_column(1, "q_joint_1", pa.array(q)), run)
        return (twin, run, "--out", out), "run.parquet, row 17, column q_joint_1: is not a finite number"
    return (twin, run, "--out", run / "out.parquet"), "cannot be written"


@pytest.mark.parametrize("fault", ["another robot", "no twin", "no run", "a bad sample", "no place"])
def test_a_fault_is_one_line_and_leaves_nothing(folder, tmp_path, fault):
    arguments, message = broken(folder, tmp_path, fault)
    said = irtwin_refuses("predict", *arguments)
    assert message in said.err
    assert [path.name for path in tmp_path.iterdir()] == ["run.parquet"]


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (["--payload-mass", "nan"], "Invalid value for '--payload-mass'"),
        (["--payload-mass", "inf"], "Invalid value for '--payload-mass'"),
        (["--payload-mass", "1e300"], "1e+300 is not in the range"),
        (["--payload-mass", "-1"], "-1.0 is not in the range"),
        (["--payload-com", "0", "nan", "0"], "Invalid value for '--payload-com'"),
        (["--payload-com", "0", "0", "-inf"], "Invalid value for '--payload-com'"),
    ],
)
def test_a_payload_that_cannot_be_is_refused(folder, tmp_path, options, message):
    said = irtwin_refuses(
        "predict", folder / "twin.json", folder / "data/runs/bare.parquet", "--out", tmp_path / "o", *options
    )
    assert message in said.err.splitlines()[-1]
    assert not (tmp_path / "o").exists()


def test_a_motion_of_another_robot_is_refused(folder, tmp_path):
    run = pq.read_table(folder / "data/runs/bare.parquet")
    pq.write_table(run.drop_columns(["q_joint_2", "tau_joint_2"]), tmp_path / "short.parquet")
    said = irtwin_refuses("predict", folder / "twin.json", tmp_path / "short.parquet", "--out", tmp_path / "o")
    assert "short.parquet: column q_joint_2 is missing" in said.err.splitlines()[-1]
