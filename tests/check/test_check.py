"""Faults put into logs whose truth is known, and into measured ones: each is found, with its channel; no other is."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from tests.data_sets import irtwin, irtwin_refuses, write
from tests.synthetic import arm, as_run, measure, swing

from irtwin.bring.robot_library import robot_of
from irtwin.check import arrangement
from irtwin.check.check import check, checked
from irtwin.check.rigid_body import RigidBodyRows
from irtwin.errors import InputError
from irtwin.modelling import sound
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.channels import Signals
from irtwin.signals.log import DataSet, read_data_set

MEASURED = Path(__file__).parents[3] / "shared/data"
ROBOT = arm(4)
SETS = ("franka_panda", "panda_gaz", "shanghai_6r", "staubli_tx40", "ur10", "ur3_power")
Change = Callable[[Signals], Signals]


def healthy() -> DataSet:
    runs = []
    for seed in range(2):
        motion = measure(ROBOT, swing(ROBOT, seed), noise=0.3, seed=seed)
        runs.append(as_run(motion, dq=motion.dq, current=None))
    return DataSet(Path("set"), ROBOT, tuple(runs), None, None, "mains", False, {})


def spoilt(data_set: DataSet, change: Change) -> DataSet:
    return replace(data_set, runs=tuple(replace(run, signals=change(run.signals)) for run in data_set.runs))


def one(field: str, joint: int, change: Callable[[np.ndarray], np.ndarray]) -> Change:
    """Change one joint's column."""

    def changed(signals: Signals) -> Signals:
        values = np.array(getattr(signals, field))
        values[:, joint] = change(values[:, joint])
        return replace(signals, **{field: values})

    return changed


def exchanged(a: int, b: int, *fields: str) -> Change:
    order = np.arange(len(ROBOT.joints))
    order[[a, b]] = b, a
    return lambda signals: replace(signals, **{field: getattr(signals, field)[:, order] for field in fields})


def held(values: np.ndarray) -> np.ndarray:
    return values[np.arange(len(values)) // 3 * 3]


def late(values: np.ndarray) -> np.ndarray:
    return np.concatenate([values[:2], values[:-2]])  # 20 ms


def found(data_set: DataSet) -> set[tuple[str, str]]:
    return {(finding.fault, finding.channel) for finding in check(data_set).findings}


def test_a_healthy_log_has_no_fault():
    assert found(healthy()) == set()


@pytest.mark.slow
@pytest.mark.parametrize("joint", [0, *(pytest.param(joint, marks=pytest.mark.nightly) for joint in (1, 2)), 3])
@pytest.mark.parametrize(
    ("field", "change", "fault", "prefix"),
    [
        ("torque", np.negative, "sign", "tau"),
        ("torque", np.zeros_like, "dead", "tau"),
        ("torque", held, "held_samples", "tau"),
        ("dq", np.negative, "sign", "dq"),
        ("dq", np.rad2deg, "unit", "dq"),
        ("dq", lambda values: 2 * values, "scale", "dq"),
        ("dq", np.zeros_like, "dead", "dq"),
        ("dq", held, "held_samples", "dq"),
        ("dq", late, "delay", "dq"),
        ("q", np.rad2deg, "unit", "q"),
        ("q", held, "held_samples", "q"),
    ],
)
def test_a_fault_of_one_joint_is_found_there_and_nowhere_else(field, change, fault, prefix, joint):
    assert (fault, f"{prefix}_joint_{joint + 1}") in found(spoilt(healthy(), one(field, joint, change)))


@pytest.mark.slow
@pytest.mark.parametrize(("a", "b"), [(0, 1), (1, 2), (2, 3), (0, 3)])
@pytest.mark.parametrize(("field", "prefix"), [("torque", "tau"), ("dq", "dq")])
def test_exchanged_columns_are_named_both(field, prefix, a, b):
    spoilt_set = spoilt(healthy(), exchanged(a, b, field))
    assert found(spoilt_set) == {("swap", f"{prefix}_joint_{a + 1} <-> {prefix}_joint_{b + 1}")}


@pytest.mark.slow
@pytest.mark.parametrize("joint", [1, 2])  # gravity tells the sign of these from that of their torque
def test_a_reversed_position_is_no_reversed_torque(joint):
    change = one("q", joint, np.negative)
    faulty = spoilt(spoilt(healthy(), change), one("dq", joint, np.negative))
    assert found(faulty) == {("sign", f"q_joint_{joint + 1}")}


def test_no_arrangement_is_tried_of_a_robot_of_many_axes(monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setattr(arrangement, "MOST_JOINTS", 3)
    monkeypatch.setattr(RigidBodyRows, "unexplained", lambda *_: pytest.fail("a fit a joint and fault"))
    assert check(healthy()).findings == ()


def test_torques_in_a_circle_are_in_another_order():
    order = np.array([1, 2, 0, 3])
    faulty = spoilt(healthy(), lambda signals: replace(signals, torque=signals.torque[:, order]))
    assert found(faulty) == {("order", "tau_joint_1 <-> tau_joint_2 <-> tau_joint_3")}


@pytest.mark.parametrize(("joint", "axis"), [(2, "1 0 0"), (3, "1 0 0"), (3, "0 0 1")])
def test_the_description_of_another_robot_is_told_by_its_axes(joint: int, axis: str):
    urdf = re.sub(rf'(name="joint_{joint}".*?<axis xyz=")[^"]*', rf"\g<1>{axis}", ROBOT.urdf, count=1)
    assert found(replace(healthy(), robot=parse_urdf(urdf))) == {("other_robot", "robot.urdf")}


def test_times_in_milliseconds_are_told_by_the_speeds_or_by_the_limits():
    in_ms: Change = lambda signals: replace(signals, time=1000 * signals.time)  # noqa: E731
    without_speed: Change = lambda signals: replace(signals, dq=None, time=100_000 * signals.time)  # noqa: E731
    assert found(spoilt(healthy(), in_ms)) == {("unit", "time")}
    assert found(spoilt(healthy(), without_speed)) == {("unit", "time")}


@pytest.mark.parametrize("factor", [1e-3, 1e9])
def test_power_in_another_unit(factor):
    assert found(spoilt(healthy(), lambda signals: replace(signals, power=factor * signals.power))) == {
        ("unit", "power")
    }


def test_a_payload_in_grams():
    data_set = healthy()
    heavy = replace(data_set, runs=tuple(replace(run, payload_mass=500.0) for run in data_set.runs))
    assert found(heavy) == {("unit", "payload_mass")}


def test_torque_without_its_sign_has_to_be_cured():
    (finding,) = check(spoilt(healthy(), lambda signals: replace(signals, torque=np.abs(signals.torque)))).findings
    assert (finding.fault, finding.stops) == ("unsigned", True)
    assert finding.say.startswith("tau_JOINT has no sign: it is never below zero, though each joint moves both ways")


@pytest.mark.slow
def test_a_sign_is_mended_and_a_dead_channel_stops():
    torque = healthy().runs[0].signals.torque
    mended = checked(spoilt(healthy(), one("torque", 2, np.negative))).data_set
    np.testing.assert_array_equal(mended.runs[0].signals.torque, torque)
    said: list[str] = []
    (kept,) = sound(spoilt(healthy(), one("torque", 2, np.negative)), said.append).repairs
    assert kept == said[0].strip() and kept.startswith("tau_joint_3 has the wrong sign")
    with pytest.raises(InputError, match="tau_joint_3 is 0 throughout, though the robot moves; connect what measures"):
        checked(spoilt(healthy(), one("torque", 2, np.zeros_like)))


def test_speeds_that_contradict_the_positions_are_left_out():
    mended = checked(spoilt(healthy(), one("dq", 0, np.rad2deg))).data_set
    assert mended.runs[0].signals.dq is None


def test_held_torques_are_joined_by_lines():
    smooth = healthy().runs[0].signals.torque
    faulty = spoilt(healthy(), one("torque", 1, held))
    mended = checked(faulty).data_set.runs[0].signals.torque
    before = np.abs(faulty.runs[0].signals.torque - smooth)[:, 1].mean()
    assert np.abs(mended - smooth)[:, 1].mean() < before


def test_what_stands_is_not_joined_over():
    def stands(signals: Signals) -> Signals:
        torque = np.array(signals.torque)
        torque[600:1000, 1] = torque[600, 1]
        return replace(signals, torque=torque)

    mended = checked(spoilt(spoilt(healthy(), stands), one("torque", 1, held))).data_set.runs[0].signals.torque
    assert np.ptp(mended[603:996, 1]) == 0


def test_a_robot_that_stands_has_nothing_to_say():
    still = spoilt(healthy(), lambda signals: replace(signals, q=np.zeros_like(signals.q)))
    assert found(still) == set()


def test_the_command_writes_its_findings_and_ends_with_2(tmp_path: Path):
    faulty = spoilt(healthy(), one("torque", 2, np.zeros_like))
    folder, out = write(tmp_path / "set", ROBOT, faulty.runs), tmp_path / "found.json"
    said = irtwin_refuses("check", folder, "--json", out)
    assert said.err.startswith("dead (cure first): tau_joint_3 is 0 throughout")
    (finding,) = json.loads(out.read_text())["findings"]
    told = {"fault": "dead", "channel": "tau_joint_3", "runs": ["swing_0", "swing_1"], "certain": True, "mended": False}
    assert finding.items() >= told.items()
    assert irtwin("check", write(tmp_path / "good", ROBOT, healthy().runs)).status == 0


@pytest.mark.parametrize("command", ["run", "diagnose"])
def test_what_must_be_cured_stops_the_commands(tmp_path: Path, command: str):
    faulty = spoilt(healthy(), one("torque", 2, np.zeros_like))
    folder = write(tmp_path / "set", ROBOT, faulty.runs)
    rest = ["--workspace", tmp_path / "w"] if command == "run" else ["--json", tmp_path / "gap.json"]
    said = irtwin_refuses(command, folder, *rest)
    assert "tau_joint_3 is 0 throughout" in said.err.splitlines()[-1]
    assert not (tmp_path / "gap.json").exists()


def measured(name: str) -> DataSet:
    if not MEASURED.is_dir():
        pytest.skip("the measured logs are not here")
    return read_data_set(MEASURED / name)


@pytest.mark.system
@pytest.mark.parametrize("name", SETS)
def test_measured_logs_show_what_is_known_of_them(name: str):
    known = {("held_samples", f"q_joint{k}") for k in range(1, 7)}
    known |= {("not_joint_torque", f"tau_joint{k}") for k in range(4, 7)}
    assert found(measured(name)) == (known if name == "shanghai_6r" else set())


@pytest.mark.system
@pytest.mark.parametrize(
    ("log", "robot"),
    [
        ("ur10", "kuka_kr6_r700"),
        ("ur10", "staubli_tx40"),
        ("airbot_coarse", "ur10"),
        ("staubli_tx40", "ur10"),
        ("staubli_tx40", "shanghai_6r"),
        ("ur10", "airbot_coarse"),
    ],
)
def test_a_measured_log_is_not_of_another_robot(log: str, robot: str):
    described = robot_of(robot)[0] if robot == "kuka_kr6_r700" else measured(robot).robot
    assert found(replace(measured(log), robot=described)) >= {("other_robot", "robot.urdf")}


@pytest.mark.system
@pytest.mark.parametrize(
    ("name", "joint"),
    [
        pytest.param(name, joint, marks=() if joint in (1, 3) else pytest.mark.nightly)
        for name in ("panda_gaz", "staubli_tx40", "ur10", "franka_panda")
        for joint in range(7 if "panda" in name else 6)
        if (name, joint) != ("franka_panda", 4)  # whose friction and gravity say too little
    ],
)
def test_a_reversed_torque_of_a_measured_robot_is_found(name: str, joint: int):
    data_set = measured(name)
    column = f"tau_{data_set.robot.joint_names[joint]}"
    assert found(spoilt(data_set, one("torque", joint, np.negative))) == {("sign", column)}
