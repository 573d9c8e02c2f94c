"""Motions in two files of lists become runs with commands; each wrong file is one line."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from tests import servo_arm
from tests.data_sets import irtwin_does

from irtwin.bring.recording import read_recording
from irtwin.errors import InputError
from irtwin.robot.urdf import parse_urdf

ROBOT = parse_urdf(servo_arm.URDF)
Q = servo_arm.swings(4, 1)
TIME = np.arange(len(Q)) / 50


def motion(
    folder: Path,
    kind: tuple[str, str] = ("CONTROL", "STATE_MOTOR"),
    begin: float = 0.0,
    scale: float = 1.0,
    torque: Callable[[float], float] = float,
) -> Path:
    """Write a motion whose states lag behind its commands, of a gripper besides the robot's two joints."""
    folder.mkdir()
    (folder / "joint_list.txt").write_text("gripper\nelbow\nlift\n")
    told, states = ["type,timestamp,positions"], ["type,timestamp,positions,velocities,torques"]
    for time, command in zip(begin + scale * TIME, Q, strict=True):
        q = 0.9 * command
        told.append(f'{kind[0]},{time:.15g},"[0.0, {command[1]}, {command[0]}]"')
        states.append(
            f'{kind[1]},{time + 0.004 * scale:.15g},"[0 {q[1]} {q[0]}]","[0, {q[1]}, 1e-3]",'
            f'"[0, {1.5 + q[1]}, {torque(q[0])}]"'
        )
    (folder / "control.csv").write_text("\n".join(told) + "\n")
    (folder / "state_motor.csv").write_text("\n".join(states) + "\n")
    return folder


def test_a_motion_has_its_states_and_the_commands_before_them(tmp_path: Path) -> None:
    columns = read_recording(motion(tmp_path / "wave"), ROBOT, {}).columns
    np.testing.assert_allclose(columns["time"], TIME + 0.004)
    for place, joint in enumerate(ROBOT.joint_names):
        np.testing.assert_allclose(columns[f"cmd_{joint}"], Q[:, place])
        np.testing.assert_allclose(columns[f"q_{joint}"], 0.9 * Q[:, place])
    np.testing.assert_allclose(columns["tau_elbow"], 1.5 + 0.9 * Q[:, 1])
    assert "q_gripper" not in columns


@pytest.mark.parametrize(("kind", "begin", "scale"), [
    (("CONTROL", "STATE_MOTOR"), 0.0, 1.0), (("Control", "StateMotor"), 1.7e14, 1e6),
])  # fmt: skip
def test_it_is_imported_from_a_simulator_in_s_and_from_a_robot_in_us(
    kind: tuple[str, str], begin: float, scale: float, tmp_path: Path
) -> None:
    folder = motion(tmp_path / "wave", kind, begin, scale)
    (tmp_path / "arm.urdf").write_text(servo_arm.URDF)
    irtwin_does("import", folder, "--robot", tmp_path / "arm.urdf", "--out", tmp_path / "set")
    (run,) = servo_arm.read_data_set(tmp_path / "set", commanded=True).runs
    assert run.name == "wave"
    assert np.ptp(run.signals.time) == pytest.approx(np.ptp(TIME), abs=1e-5)
    np.testing.assert_allclose(run.signals.command, Q)
    np.testing.assert_allclose(run.signals.q, 0.9 * Q)
    assert run.signals.torque is not None


def test_torque_without_its_sign_is_written_as_that_and_the_commands_are_of_use(tmp_path: Path) -> None:
    folder = motion(tmp_path / "wave", torque=abs)
    (tmp_path / "arm.urdf").write_text(servo_arm.URDF)
    said = irtwin_does("import", folder, "--robot", tmp_path / "arm.urdf", "--out", tmp_path / "set")
    assert "tau_abs_JOINT is torque without its sign, as of a current's size, and no torque: left out" in said.err
    assert f"then: irtwin diagnose {tmp_path / 'set'} --simulator MODEL.xml" in said.err
    (run,) = servo_arm.read_data_set(tmp_path / "set", commanded=True).runs
    assert run.signals.torque is None
    written = pyarrow.parquet.read_table(run.file)
    np.testing.assert_allclose(written["tau_abs_lift"].to_numpy(), abs(0.9 * Q[:, 0]))


def replaced(name: str, old: str, new: str) -> Callable[[Path], None]:
    def spoil(folder: Path) -> None:
        text = (folder / name).read_text()
        assert old in text
        (folder / name).write_text(text.replace(old, new, 1))

    return spoil


def without(name: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).unlink()


def holding(name: str, text: str) -> Callable[[Path], None]:
    return lambda folder: (folder / name).write_text(text) and None


STATES, HEAD = "state_motor.csv", "type,timestamp,positions\n"
WRONG = {
    "control.csv: cannot be read": without("control.csv"),
    "joint_list.txt: has no joint lift; its joints are gripper, elbow, left: give": replaced(
        "joint_list.txt", "lift", "left"
    ),
    "state_motor.csv, line 2, column positions: 3 values, not 2, one a joint": without("joint_list.txt"),
    "control.csv, line 1: has no column timestamp; its columns are type, stamp, positions": replaced(
        "control.csv", "timestamp", "stamp"
    ),
    r"line 2, column torques: '\[0, one, 0.0\]' is no list of numbers": replaced(STATES, "1.5", "one"),
    "state_motor.csv, sample 2: time falls, or is blank; sort": replaced(STATES, ",0.024,", ",-0.024,"),
    "sample 2: time falls, or is blank; sort the file by timestamp": replaced(STATES, ",0.024,", ",,"),
    "state_motor.csv: has no sample": holding(STATES, HEAD),
    "commands are of the times 100 to 100, states of 0.004 to 3.984; give both by one clock": holding(
        "control.csv", f'{HEAD}C,100,"[0,0,0]"\n'
    ),
}


@pytest.mark.parametrize("message", WRONG)
def test_what_is_wrong_is_one_line(message: str, tmp_path: Path) -> None:
    folder = motion(tmp_path / "wave")
    WRONG[message](folder)
    with pytest.raises(InputError, match=message):
        read_recording(folder, ROBOT, {})


def test_one_of_the_files_alone_is_refused(tmp_path: Path) -> None:
    folder = motion(tmp_path / "wave")
    with pytest.raises(InputError, match=r"control.csv: is one of a motion's two files; give their folder, .*wave"):
        read_recording(folder / "control.csv", ROBOT, {})
