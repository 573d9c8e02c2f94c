"""Reading a data set: what is understood, and what each fault is called."""

import math
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from hypothesis import given
from hypothesis import strategies as st

from irtwin.errors import InputError
from irtwin.robot.urdf import parse_urdf
from irtwin.signals.log import read_data_set
from irtwin.signals.samples import read_signals

URDF = """<robot name="two">
  <link name="base"/><link name="l1"/><link name="l2"/>
  <joint name="a" type="revolute"><parent link="base"/><child link="l1"/><axis xyz="0 0 1"/>
    <limit lower="-3" upper="3" velocity="4" effort="10"/></joint>
  <joint name="b" type="revolute"><parent link="l1"/><child link="l2"/><axis xyz="0 1 0"/>
    <limit lower="-2" upper="2" velocity="4" effort="10"/></joint>
</robot>"""

TOML = """
[robot]
name = "Two"
urdf = "robot.urdf"
weight = 12.5
torque = "a note"
[robot.joint.a]
gear_ratio = 50
torque_constant = 2.0
[robot.joint.b]
torque_constant = 3.0
[[run]]
file = "runs/one.csv"
payload_mass = 1.5
payload_com = [0, 0, 0.1]
started = 2026-03-02T08:00:00
[[run]]
file = "runs/two.csv"
repeat_of = "runs/one.csv"
role = "reference"
"""


def columns(samples: int = 50) -> dict[str, np.ndarray]:
    time = np.arange(samples) * 0.01
    return {
        "time": time,
        "q_a": np.sin(time),
        "q_b": np.cos(time),
        "tau_a": np.full(samples, 1.0),
        "tau_b": np.full(samples, 2.0),
        "power": np.full(samples, 100.0),
        "mood": np.arange(samples),
    }


def write_csv(path: Path, signals: dict[str, np.ndarray]) -> Path:
    rows = [",".join(signals)] + [",".join(repr(float(v)) for v in row) for row in zip(*signals.values(), strict=True)]
    path.parent.mkdir(exist_ok=True, parents=True)
    path.write_text("\n".join(rows) + "\n")
    return path


def test_columns_of_a_joint_that_mimics_another_are_left_out_and_it_is_said(folder: Path):
    finger = '<joint name="b_too" type="revolute"><parent link="l2"/><child link="tip"/><mimic joint="b"/></joint>'
    urdf = URDF.replace("</robot>", f'<link name="tip"/>{finger}</robot>')
    (folder / "robot.urdf").write_text(urdf)
    write_csv(folder / "runs/one.csv", columns() | {"q_b_too": np.zeros(50), "tau_b_too": np.zeros(50)})
    data_set = read_data_set(folder)
    assert data_set.robot.joint_names == ("a", "b")
    assert "joint b_too mimics another: it is held at zero, and left out of the logs" in data_set.repairs[0]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "dataset.toml").write_text(TOML)
    (tmp_path / "robot.urdf").write_text(URDF)
    write_csv(tmp_path / "runs/one.csv", columns())
    write_csv(tmp_path / "runs/two.csv", columns())
    return tmp_path


ROBOT = parse_urdf(URDF)


def test_a_data_set_is_understood(folder):
    data_set = read_data_set(folder)
    assert data_set.robot.name == "Two"
    assert data_set.robot.weight == 12.5
    assert data_set.robot.joints[0].gear_ratio == 50
    assert data_set.effects is None
    assert data_set.power_at is None  # nobody said
    assert data_set.notes["torque"] == "a note"
    one, two = data_set.runs
    assert (one.name, one.role, one.payload_mass, one.payload_com) == ("one", "observed", 1.5, (0.0, 0.0, 0.1))
    assert one.started.isoformat() == "2026-03-02T08:00:00+00:00"
    assert (two.role, two.repeat_of) == ("reference", "one")
    assert np.allclose(one.signals.q[:, 0], np.sin(one.signals.time))
    assert one.signals.torque.shape == (50, 2)
    assert one.signals.temperature is None


def test_a_cutoff_may_be_stated(folder: Path) -> None:
    assert read_data_set(folder).cutoff is None
    with (folder / "dataset.toml").open("a") as file:
        file.write("[twin]\ncutoff = 30\n")
    assert read_data_set(folder).cutoff == 30.0


def test_parquet_and_csv_say_the_same(tmp_path):
    signals = columns()
    single = signals | {"power": pa.array(signals["power"], pa.float32())}
    pq.write_table(pa.table(single), tmp_path / "run.parquet")
    from_parquet, _ = read_signals(tmp_path / "run.parquet", ROBOT)
    from_csv, _ = read_signals(write_csv(tmp_path / "run.csv", signals), ROBOT)
    assert np.array_equal(from_parquet.q, from_csv.q)
    assert np.array_equal(from_parquet.power, from_csv.power)


def test_current_becomes_torque_and_voltage_times_current_power(folder):
    signals = columns()
    del signals["tau_a"], signals["tau_b"], signals["power"]
    half = np.full(50, 0.5)
    write_csv(folder / "runs/one.csv", signals | {"i_a": half, "i_b": half, "voltage": half * 96, "current": half})
    run = read_data_set(folder).runs[0]
    assert np.allclose(run.signals.torque, [[1.0, 1.5]])
    assert np.allclose(run.signals.power, 24.0)


def changed(name: str, row: int, value: float) -> dict[str, np.ndarray]:
    signals = columns()
    signals[name] = signals[name].astype(float)
    signals[name][row] = value
    return signals


@pytest.mark.parametrize(
    ("signals", "message"),
    [
        ({k: v for k, v in columns().items() if k != "q_b"}, "column q_b is missing"),
        ({k: v for k, v in columns().items() if k != "time"}, "column time is missing"),
        ({"time": columns()["time"], "power": columns()["time"]}, r"q_a is missing; .* say joints = \[\] and no urdf"),
        ({k: v for k, v in columns().items() if k != "tau_b"}, "column tau_b is missing; log tau_ for every"),
        (columns() | {"q_elbow": np.zeros(50)}, 'column q_elbow: the robot has no moving joint "elbow"'),
        (changed("tau_a", 7, math.nan), "line 9, column tau_a: is not a finite number"),
        (changed("q_a", 3, math.inf), "line 5, column q_a: is not a finite number"),
        (changed("tau_b", 10, 1e282), "line 12, column tau_b: is beyond 1e\\+06, which no robot reaches"),
        (changed("time", 20, 0.05), "line 22, column time: does not rise"),
        (columns(0), "has no sample"),
        (columns(5), "has 5 samples"),
        ({k: v for k, v in columns().items() if k[:3] not in ("tau", "pow")}, "neither torque nor power"),
    ],
)
def test_bad_samples_are_named(tmp_path, signals, message):
    with pytest.raises(InputError, match=message):
        read_signals(write_csv(tmp_path / "run.csv", signals), ROBOT)


@pytest.mark.parametrize(
    ("edit", "message"),
    [
        (lambda text: "", "is empty"),
        (lambda text: text.replace("tau_a", "q_a", 1), "column q_a occurs twice"),
        (lambda text: text.rstrip().rpartition(",")[0], "line 51, the last one: the file was cut off: 6 values"),
        (lambda text: text.replace("0.03,", "0.03,oops,", 1), "line 5: 8 values instead of 7"),
        (lambda text: text.replace("\n0.04,", "\nlate,", 1), "line 6, column time: is not a finite number"),
        (lambda text: text.replace(",", ";"), "line 1: columns are separated by semicolons; separate them by commas"),
    ],
)
def test_broken_text_is_named(tmp_path, edit, message):
    path = write_csv(tmp_path / "run.csv", columns())
    path.write_text(edit(path.read_text()))
    with pytest.raises(InputError, match=message):
        read_signals(path, ROBOT)


def test_parquet_faults_name_the_row(tmp_path):
    pq.write_table(pa.table(changed("q_b", 4, math.nan)), tmp_path / "run.parquet")
    with pytest.raises(InputError, match="row 4, column q_b"):
        read_signals(tmp_path / "run.parquet", ROBOT)
    whole = (tmp_path / "run.parquet").read_bytes()
    (tmp_path / "cut.parquet").write_bytes(whole[: len(whole) // 2])
    with pytest.raises(InputError, match="not a readable Parquet file"):
        read_signals(tmp_path / "cut.parquet", ROBOT)


def test_repair_drops_bad_samples_and_says_which(tmp_path):
    signals = changed("tau_a", 7, math.nan)
    signals["time"][20] = 0.05
    path = write_csv(tmp_path / "run.csv", signals)
    path.write_text(path.read_text().rstrip().rpartition(",")[0])
    read, said = read_signals(path, ROBOT, repair=True)
    assert len(read.time) == 47
    assert (np.diff(read.time) > 0).all()
    assert any("1 samples dropped" in line and "line 9" in line and "tau_a" in line for line in said)
    assert any("line 22" in line and "time" in line for line in said)
    assert any("line 51" in line for line in said)


@given(bad=st.sets(st.integers(0, 49), max_size=20), value=st.sampled_from([math.nan, math.inf, -math.inf, 1e282]))
def test_repair_keeps_exactly_the_good_samples(tmp_path_factory, bad, value):
    signals = columns()
    signals["power"][sorted(bad)] = value
    path = tmp_path_factory.mktemp("run") / "run.parquet"
    pq.write_table(pa.table(signals), path)
    read, _ = read_signals(path, ROBOT, repair=True)
    assert np.array_equal(read.time, np.delete(signals["time"], sorted(bad)))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ('name = "Two"', "name = ", "not valid TOML: .*line 3"),
        ('name = "Two"', "", r"\[robot\] name is missing"),
        ('urdf = "robot.urdf"', "", r"\[robot\] urdf is missing"),
        ('"robot.urdf"', '"../robot.urdf"', "leads outside the data set"),
        ('"robot.urdf"', '"other.urdf"', "there is no such file"),
        ("weight = 12.5", 'weight = "heavy"', "weight should be a number"),
        ("[robot.joint.b]", "[robot.joint.c]", 'no moving joint "c"'),
        ("gear_ratio = 50", "gear_ratio = -50", "gear_ratio should be a number of at least 0"),
        ('role = "reference"', 'role = "golden"', 'role = "golden"; use observed'),
        ("payload_mass = 1.5", "payload_mass = nan", "payload_mass should be a number"),
        ("[0, 0, 0.1]", "[0, 0]", "payload_com should be three numbers"),
        ('repeat_of = "runs/one.csv"', 'repeat_of = "runs/two.csv"', "is not another run of this data set"),
        ("started =", 'repeat_of = "runs/two.csv"\nstarted =', "repeat each other in a circle"),
        ('"runs/two.csv"', '"runs/three.csv"', "no such file"),
        ("2026-03-02T08:00:00", '"monday"', "started should be a TOML date"),
        ("weight = 12.5", 'power_at = "moon"', "use mains or dc_bus"),
        ("weight = 12.5", "torque_scale_uncertainty = 10", "uncertainty should be a share below 1, not 10"),
        ("weight = 12.5", "torque_scale_uncertainty = -0.1", "uncertainty should be a number of at least 0"),
        ("[[run]]", "[[walk]]", r"\[\[run\]\] is missing"),
        ("gear_ratio", "gear_ration", r"\[robot.joint.a\] gear_ration is not known; did you mean gear_r"),
        ("gear_ratio", "colour", r"\[robot.joint.a\] colour is not known; it may have gear_ratio, rotor_inertia, tor"),
        ("payload_mass", "peices = 3\npayload_mass", r"\[\[run\]\] 1 peices is not known; did you mean pieces\?"),
        (
            "payload_mass",
            "pieces = 0\npayload_mass",
            r"\[run\]\] 1 pieces should be a whole number of 1 or more, not 0",
        ),
        ("payload_mass", "cycles = 2.5\npayload_mass", r"\[\[run\]\] 1 cycles should be a whole number .*, not 2.5"),
        ("payload_mass", "product = 12\npayload_mass", r"\[\[run\]\] 1 product should be"),
        ("payload_mass", "payload_mas", r"\[\[run\]\] 1 payload_mas is not known; did you mean payload_mass\?"),
        ("payload_mass", "payload", r"\[\[run\]\] 1 payload is not known; did you mean payload_mass\?"),
        ('role = "reference"', 'roles = "reference"', r"\[\[run\]\] 2 roles is not known; did you mean role\?"),
        ("", "[twin]\neffect = ['rigid_body']", r"\[twin\] effect is not known; did you mean effects\?"),
        ("", "twin = 5", r"dataset\.toml: \[twin\] should be a table"),
        ("", "[twin]\ncutoff = '5 Hz'", r"dataset\.toml: \[twin\] cutoff should be a number, not '5 Hz'"),
        ("", "[twin]\ncutoff = nan", r"dataset\.toml: \[twin\] cutoff should be a number, not nan"),
        ("", "[twin]\ncutoff = 0", r"dataset\.toml: \[twin\] cutoff should be at least 20.4 Hz, .*, not 0"),
        ("", "[twin]\ncutoff = 1e9", r"cutoff should be .* below 50 Hz, half .* rate, not 1e\+09"),
        ("", "[twin]\ncut_off = 30", r"\[twin\] cut_off is not known; did you mean cutoff\?"),
        ("", "[twins]", "dataset.toml: twins is not known; did you mean twin\\?"),
    ],
)
def test_faults_of_the_toml_are_named(folder, old, new, message):
    """What stands in no other's place stands before all."""
    (folder / "dataset.toml").write_text(TOML.replace(old, new) if old else new + TOML)
    with pytest.raises(InputError, match=message):
        read_data_set(folder)


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ("weight =", "wieght =", ["[robot] wieght is kept as a note; did you mean weight?"]),
        ("weight =", "colour =", []),
        ("payload_mass =", "shift =", []),
    ],
)
def test_what_the_log_format_does_not_know_is_a_note(folder, old, new, said):
    file = folder / "dataset.toml"
    file.write_text(file.read_text().replace(old, new))
    assert read_data_set(folder).repairs == tuple(f"{file}: {line}" for line in said)


def test_a_log_alone_is_no_data_set_and_import_makes_one(tmp_path: Path) -> None:
    log = write_csv(tmp_path / "log.csv", columns())
    with pytest.raises(InputError, match=r"log\.csv: is a file; .*`irtwin import .*log\.csv --robot ROBOT --out FOL"):
        read_data_set(log)


def test_a_folder_without_a_data_set(tmp_path):
    with pytest.raises(InputError, match=r"dataset\.toml: not found"):
        read_data_set(tmp_path)
