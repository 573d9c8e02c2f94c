"""Logs of others become data sets: what cannot be told is asked, what is no log refused with its place."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from tests.bring.dialects import NAME, assert_same, good, per_joint, robot, signals, write_text
from tests.data_sets import irtwin, irtwin_does

from irtwin.bring.bring import Options, bring, found_in, init
from irtwin.bring.doubt import DoubtError, WayOut
from irtwin.bring.robot_library import robot_of, robots, with_fixed
from irtwin.errors import InputError
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.log import DATA_SET_KEYS, ROBOT_KEYS, RUN_KEYS, SHEET_KEYS, TWIN_KEYS, read_data_set

MAINS = Options(power_at="mains")


def plain(folder: Path, **changes: np.ndarray) -> Path:
    columns = {"time": good()["time"]} | per_joint("q", "pos{}") | per_joint("tau", "trq{}")
    return write_text(folder / "run.csv", columns | changes)


@pytest.mark.parametrize(
    ("columns", "options", "question", "gives"),
    [
        (
            {"t": "time"} | {f"T{k}": f"tau_joint_a{k}" for k in range(1, 7)}, Options(),
            "columns T1 to T6 could be torques or temperatures", "--map 'T*=tau' or --map 'T*=temp'",
        ),
        ({"P": "power"}, Options(), "column P: nothing says whether power was measured", "--power-at mains or"),
        ({"power": "power"}, Options(), "column power: nothing says whether power was measured", "--power-at mains or"),
        (
            {f"speed{k}": "time" for k in range(1, 7)}, Options(), r"speed1 \(speed\) could be in rad/s or deg/s",
            "--map speed1=dq_joint_a1:rad/s or",
        ),
        (
            {f"position_filtered{k}": f"q_joint_a{k}" for k in range(1, 7)}, Options(),
            "columns pos1 to pos6 and position_filtered1 to position_filtered6 could each be position",
            "--map 'position_filtered*=-' or --map pos1=-",
        ),
        (
            {f"motor_torque{k}": f"tau_joint_a{k}" for k in range(1, 7)}, Options(maps=("trq*=-",)),
            "column motor_torque1 is of the motor's side by its name", "--gear-ratio joint_a1=RATIO or --map",
        ),
        (
            {"power_W": "time"}, MAINS, r"column power_W \(electrical power\) is in W by its name, and cannot be",
            "--map power_W=power:W or --map power_W=-",
        ),
    ],
)  # fmt: skip
def test_what_cannot_be_told_stops_with_what_to_give(
    tmp_path: Path, columns: dict[str, str], options: Options, question: str, gives: str
) -> None:
    log = plain(tmp_path, **{name: good()[of] * (1e-3 if name == "power_W" else 1) for name, of in columns.items()})
    with pytest.raises(DoubtError, match=question) as doubt:
        bring([log], tmp_path / "set", NAME, options)
    assert gives in str(doubt.value)
    assert sorted(tmp_path.iterdir()) == [log]


def test_all_that_cannot_be_told_is_asked_for_in_one_line(tmp_path: Path) -> None:
    columns = {"t": good()["time"], "P": good()["power"]} | {f"T{k}": good()[f"tau_joint_a{k}"] for k in range(1, 7)}
    log = plain(tmp_path, **columns)
    with pytest.raises(InputError) as asked:
        bring([log], tmp_path / "set", NAME, Options())
    assert str(asked.value).count("--map 'T*=tau' or --map 'T*=temp'; and ") == 1
    assert str(asked.value).endswith("give --power-at mains or --power-at dc_bus")
    bring([log], tmp_path / "set", NAME, Options(maps=("T*=-",), power_at="mains"))


def test_numbers_of_a_message_of_ros_say_no_joint(tmp_path: Path) -> None:
    columns = {"time": good()["time"]} | per_joint("q", "/joint_states/position[{}]", 0)
    log = write_text(tmp_path / "run.csv", columns | per_joint("tau", "/joint_states/effort[{}]", 0))
    with pytest.raises(InputError, match="joints come in any order") as doubt:
        bring([log], tmp_path / "set", NAME, Options())
    assert "give --map '/joint_states/position[*]=q'; and " in str(doubt.value)
    assert str(doubt.value).endswith("give --map '/joint_states/effort[*]=tau'")
    bring([log], tmp_path / "set", NAME, Options(), lambda doubt: doubt.answers[0])
    assert_same(read_data_set(tmp_path / "set"), "q torque")


def test_an_answer_is_taken_as_if_it_had_been_typed(tmp_path: Path) -> None:
    log = plain(tmp_path, power=good()["power"], **{f"load{k}": good()[f"tau_joint_a{k}"] for k in range(1, 7)})
    asked: list[str] = []

    def ask(doubt: DoubtError) -> WayOut:
        asked.append(doubt.question)
        return doubt.answers[-1]

    bring([log], tmp_path / "set", NAME, Options(maps=("load*=tau", "trq*=-")), ask)
    assert len(asked) == 1
    assert read_data_set(tmp_path / "set").power_at == "dc_bus"
    assert_same(read_data_set(tmp_path / "set"))


@pytest.mark.slow
def test_a_word_on_one_column_counts_for_those_beside_it(tmp_path: Path) -> None:
    columns = {"time": good()["time"]} | per_joint("q", "c{}", factor=1000.0) | per_joint("tau", "trq{}")
    maps = [f"c{k}=q_joint_a{k}{':mrad' if k == 1 else ''}" for k in range(1, 7)]
    log = write_text(tmp_path / "run.csv", columns)
    said = irtwin_does(
        "import", log, "--robot", NAME, "--out", tmp_path / "set", *(x for one in maps for x in ("--map", one))
    )
    assert "mrad as c1" in said.out
    assert_same(read_data_set(tmp_path / "set"), "q torque")


@pytest.mark.slow
def test_a_motion_without_torque_asks_which_columns_are_it(tmp_path: Path) -> None:
    columns = {"time": good()["time"]} | per_joint("q", "pos{}") | per_joint("tau", "xy{}")
    log = write_text(tmp_path / "run.csv", columns)
    said = irtwin("import", log, "--robot", NAME, "--out", tmp_path / "set")
    assert (said.status, (tmp_path / "set").exists()) == (2, False)
    assert "no column was taken for torque, motor current or power" in said.err
    assert "--map 'xy*=tau' or --map 'xy*=i' (not used are xy1, xy2" in said.err
    assert irtwin("import", log, "--robot", NAME, "--map", "xy*=tau", "--out", tmp_path / "set").status == 0


@pytest.mark.parametrize(("number", "channels"), [(1, [f"dq_joint_a{k}" for k in range(1, 7)]), (2, [""] * 6)])
def test_one_joint_that_is_given_tells_those_that_are_counted_on(
    tmp_path: Path, number: int, channels: list[str]
) -> None:
    speeds = np.gradient(good()["q_joint_a1"], good()["time"])
    log = plain(tmp_path, **{f"speed{k}": speeds for k in range(1, 7)})
    (form,) = bring([log], tmp_path / "set", NAME, Options(maps=(f"speed{number}=dq_joint_a1:rad/s",)))
    assert [one.channel for one in form.columns if one.column.startswith("speed")] == channels


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (Options(maps=("nothing=q",)), "--map nothing=...: no file has such a column; there are time, pos1"),
        (Options(maps=("pos1=angle",)), "angle is no channel; use time, q, dq"),
        (Options(maps=("pos1=q:Nm",)), "Nm is no unit of position; its SI unit is rad"),
        (Options(maps=("pos1",)), "give COLUMN=CHANNEL or COLUMN=CHANNEL:UNIT"),
        (Options(maps=("pos1=-",)), "no column was taken for the position of joint_a1; say which it is: --map COLUMN="),
        (Options(gear_ratios=("joint_x=3",)), 'the robot has no joint "joint_x"'),
        (Options(gear_ratios=("a lot",)), "give RATIO or JOINT=RATIO"),
        (Options(topics=("power",)), "--topic power: give COLUMN=TOPIC"),
    ],
)
def test_a_word_that_says_nothing_is_refused(tmp_path: Path, options: Options, says: str) -> None:
    with pytest.raises(InputError, match=re.escape(says)):
        bring([plain(tmp_path)], tmp_path / "set", NAME, options)


@pytest.mark.parametrize(
    ("content", "says"),
    [
        ("", "is empty"),
        ("just a line of words", "no delimiter"),
        ("a,b\n" + "1" * 200_000 + ",2\n", "no delimiter"),
        ("\0\0\0", "is no text"),
        ("time,a,b\n" + "0,1,2\n" * 30 + "1,2\n" + "0,1,2\n", "line 32: 2 values instead of 3"),
        ("t,a,b,c\n" + "0,1,2,5,1,2,3,4\n" * 30, "have 8 values, the line above them 4 names; where decimals"),
        ("time,a,b\n" + "10:30:00,1,2\n" * 30, "column time holds neither numbers nor dates and times of ISO 8601"),
        ("time,a,a\n" + "0,1,2\n" * 30, "column a occurs twice"),
        ("time,a,b\n" + "0,1,2\n" * 60 + "0,x,2\n", "line 62, column a: 'x' is no number"),
    ],
)
def test_what_is_no_log_is_refused_with_its_place(tmp_path: Path, content: str, says: str) -> None:
    (tmp_path / "run.csv").write_text(content)
    with pytest.raises(InputError, match=re.escape(says)):
        bring([tmp_path / "run.csv"], tmp_path / "set", NAME, Options())


def test_several_logs_are_several_runs_and_a_taken_folder_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "other").mkdir()
    logs = [plain(tmp_path), plain(tmp_path / "other")]
    assert len(bring(logs, tmp_path / "set", NAME, Options(name="Mine"))) == 1
    data_set = read_data_set(tmp_path / "set")
    assert ([run.name for run in data_set.runs], data_set.robot.name) == (["run", "run_2"], "Mine")
    before = (tmp_path / "set" / "dataset.toml").read_bytes()
    with pytest.raises(InputError, match="is not empty; name a new folder"):
        bring(logs, tmp_path / "set", NAME, Options())
    assert (tmp_path / "set" / "dataset.toml").read_bytes() == before


def test_a_robot_is_known_by_name_where_its_package_is_installed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match=r"no robot of that name; there is kuka_kr6_r700"):
        robot_of("KUKA KR6 R70")
    described = tmp_path / "share" / "arm6_robot.urdf"
    described.parent.mkdir()
    described.write_text(robot().urdf)
    info = tmp_path / "example_robot_data-6.0.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: example-robot-data\nVersion: 6.0.0\n")
    (info / "RECORD").write_text("share/arm6_robot.urdf,,\n")
    monkeypatch.syspath_prepend(tmp_path)
    robots.cache_clear()
    found, origin = robot_of("Arm-6")
    robots.cache_clear()
    assert found.joint_names == robot().joint_names
    assert origin == "arm6 of example-robot-data"


def of_joints(folder: Path, *numbers: int) -> Path:
    """A log of the positions and torques of some joints."""
    columns = [f"{kind}_joint_a{number}" for number in numbers for kind in ("q", "tau")]
    return write_text(folder / "run.csv", {name: good()[name] for name in ("time", *columns)})


def test_a_joint_that_is_not_logged_can_be_fixed(tmp_path: Path) -> None:
    log = of_joints(tmp_path, *range(1, 6))
    told = r"--map COLUMN=q_joint_a6, or, where they stood still, --fixed joint_a6 .there"
    with pytest.raises(InputError, match=told):
        bring([log], tmp_path / "set", NAME, Options())
    bring([log], tmp_path / "set", NAME, Options(fixed=("joint_a6",)))
    data_set = read_data_set(tmp_path / "set")
    assert data_set.robot.joint_names == robot().joint_names[:5]
    np.testing.assert_array_equal(data_set.runs[0].signals.q, signals(good()).q[:, :5])
    with pytest.raises(InputError, match=r"--fixed joint_7: the robot has no joint .joint_7. .it has"):
        bring([log], tmp_path / "other", NAME, Options(fixed=("joint_7",)))


def test_all_joints_that_are_missing_are_told_at_once_and_held_by_a_pattern(tmp_path: Path) -> None:
    log = of_joints(tmp_path, 1, 2, 3)
    told = r"the position of joint_a4 and 2 other joints; .* --fixed joint_a4 --fixed joint_a5 --fixed"
    with pytest.raises(InputError, match=told):
        bring([log], tmp_path / "set", NAME, Options())
    bring([log], tmp_path / "set", NAME, Options(fixed=("joint_a[456]",)))
    assert read_data_set(tmp_path / "set").robot.joint_names == robot().joint_names[:3]


def test_a_joint_that_mimics_another_is_held_already(tmp_path: Path) -> None:
    limits = '<axis xyz="1 0 0"/><limit lower="0" upper="1" velocity="1" effort="1"/>'
    finger = '<link name="finger"/><joint name="finger_joint" type="prismatic"><parent link="base_link"/>'
    finger += f'<child link="finger"/>{limits}'
    mimic = '<mimic joint="joint_a6"/></joint></robot>'
    described = parse_urdf(robot().urdf.replace("</robot>", finger + mimic))
    assert with_fixed(described, ("finger*",)).joint_names == robot().joint_names


@pytest.mark.slow
def test_commands_without_torque_are_for_a_simulators_model(tmp_path: Path) -> None:
    commands = {f"cmd_joint_a{k}": good()[f"q_joint_a{k}"] + 0.01 for k in range(1, 7)}
    columns = {name: values for name, values in good().items() if name[:2] in ("ti", "q_")} | commands
    bring([write_text(tmp_path / "run.csv", columns)], tmp_path / "set", NAME, Options())
    assert found_in(tmp_path / "set")[1] == f"irtwin diagnose {tmp_path / 'set'} --simulator MODEL.xml"
    bring([plain(tmp_path)], tmp_path / "other", NAME, Options())
    assert found_in(tmp_path / "other")[1] == f"irtwin run {tmp_path / 'other'}"


def test_a_log_without_names_is_given_some(tmp_path: Path) -> None:
    log = plain(tmp_path)
    names, body = log.read_text().split("\n", 1)
    log.write_text(body)
    (form,) = bring([log], tmp_path / "set", NAME, Options(names=tuple(names.split(","))))
    assert [line for line in form.said if "has no line of names; they are those of --names" in line]
    np.testing.assert_allclose(read_data_set(tmp_path / "set").runs[0].signals.q, signals(good()).q, atol=1e-6)
    with pytest.raises(InputError, match=r"columns; --names gives 2 different names"):
        bring([log], tmp_path / "other", NAME, Options(names=("a", "b")))
    with pytest.raises(InputError, match=r"has names of its own, as time; --map says what a column is"):
        bring([plain(tmp_path)], tmp_path / "other", NAME, Options(names=("a", "b")))


def test_a_last_line_that_is_cut_off_is_left_out_and_told(tmp_path: Path) -> None:
    log = plain(tmp_path)
    log.write_bytes(log.read_bytes().rstrip()[:-40])
    (form,) = bring([log], tmp_path / "set", NAME, Options())
    assert [line for line in form.said if "the last, is cut off; it is left out" in line]
    assert len(read_data_set(tmp_path / "set").runs[0].signals.time) == len(good()["time"]) - 1


def test_an_empty_data_set_explains_each_key(tmp_path: Path) -> None:
    assert irtwin("import", "--robot", NAME, "--out", tmp_path / "set").status == 0
    text = (tmp_path / "set" / "dataset.toml").read_text()
    for key in (*ROBOT_KEYS, *RUN_KEYS, *SHEET_KEYS, *TWIN_KEYS, *DATA_SET_KEYS):
        assert key in text or key == "dh"
    write_text(tmp_path / "set" / "runs" / "NAME.csv", good())
    filled = re.sub(
        r"(?m)^# (\[\[run\]\]|file|role|payload_\w+|started|gear_ratio|weight|\[twin\]|effects)", r"\1", text
    )
    (tmp_path / "set" / "dataset.toml").write_text(filled)
    data_set = read_data_set(tmp_path / "set")
    assert [joint.gear_ratio for joint in data_set.robot.joints] == [100.0] * 6
    assert irtwin("import", "--out", tmp_path / "set").status == 2
    init(tmp_path / "bare", None, None)
    assert "# [robot.joint.NAME]" in (tmp_path / "bare" / "dataset.toml").read_text()
