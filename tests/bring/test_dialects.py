"""Logs as others write them come back as the same numbers in SI units: text, workbooks, bags, recordings of RTDE."""

from __future__ import annotations

import csv
import re
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from tests.bring.dialects import NAME, assert_same, good, per_joint, robot, signals, write_text
from tests.data_sets import irtwin_does
from tests.signals.bags import of_run, write
from tests.signals.test_sources import Numbered

from irtwin.bring.bring import Options, bring
from irtwin.check.check import check
from irtwin.errors import InputError
from irtwin.signals.channels import columns_of
from irtwin.signals.log import DataSet, read_data_set
from irtwin.signals.sources import catalogue

MEASURED = Path(__file__).parents[3] / "shared/data"
STARTED = datetime(2026, 3, 2, 8, 0, 0, 250_000, tzinfo=UTC)
MAINS = Options(power_at="mains")


def brought(file: Path, options: Options = MAINS, robot_name: str = NAME) -> DataSet:
    out = file.parent / "set"
    bring([file], out, robot_name, options)
    return read_data_set(out)


def german(folder: Path) -> Path:
    columns = {"Zeit [ms]": 1000 * good()["time"]}
    columns |= per_joint("q", "A{} Istposition [Grad]", factor=180 / np.pi)
    columns |= per_joint("tau", "Drehmoment A{} [Nm]") | {"Wirkleistung Netz [kW]": good()["power"] / 1000}
    return write_text(folder / "trace.csv", columns, ";", ",", head=["Trace;of;monday"])


def nameless_units(folder: Path) -> Path:
    columns = {"t": 1e6 * good()["time"]} | per_joint("tau", "torque_{}", 0, factor=1000)
    columns |= per_joint("q", "pos_{}", 0, factor=180 / np.pi) | per_joint("dq", "vel_{}", 0, factor=30 / np.pi)
    return write_text(folder / "run.csv", columns | {"power": good()["power"] / 1000})


def row_of_units(folder: Path) -> Path:
    columns = {"time": good()["time"]} | per_joint("q", "joint {}", factor=180 / np.pi)
    columns |= per_joint("tau", "effort {}") | {"p_el power": good()["power"]}
    units = ["s", *["deg"] * 6, *["Nm"] * 6, "W"]
    return write_text(folder / "run.txt", columns, "\t", units=units)


def iso_times(folder: Path) -> Path:
    moments = np.datetime64(STARTED.replace(tzinfo=None), "us") + np.round(good()["time"] * 1e6).astype(
        "timedelta64[us]"
    )
    columns: dict[str, np.ndarray | list[str]] = {"datetime": [f"{moment}Z" for moment in moments]}
    columns |= per_joint("q", "J{} (rad)") | per_joint("tau", "J{} [Nm]") | {"P [W]": good()["power"]}
    return write_text(folder / "run.csv", columns)


def epoch_times(folder: Path) -> Path:
    first = int(STARTED.timestamp()) * 10**9 + STARTED.microsecond * 1000
    stamps = [str(first + round(time * 1e9)) for time in good()["time"].tolist()]
    columns = {"timestamp": stamps} | per_joint("q", "act_pos_A{}") | per_joint("tau", "act_trq_A{}")
    return write_text(folder / "run.csv", columns | {"power": good()["power"]}, " ")


def plot_juggler(folder: Path) -> Path:
    """Topics of two rates, on one axis of time: what did not come at a time is blank."""
    time = good()["time"]
    power = good()["power"].copy()
    power[1:-1:2] = np.nan
    columns = {"__time": 1_772_438_400.0 + time}
    for k, joint in enumerate(robot().joint_names, start=1):
        columns[f"/joint_states/joint_a{k}/position"] = good()[f"q_{joint}"]
        columns[f"/joint_states/joint_a{k}/velocity"] = good()[f"dq_{joint}"]
        columns[f"/joint_states/joint_a{k}/effort"] = good()[f"tau_{joint}"]
    columns |= {"/joint_states/header/stamp": time, "/meter/mains/power": power}
    return write_text(folder / "plot.csv", columns)


def motor_side(folder: Path) -> Path:
    columns = {"time_s": good()["time"]} | per_joint("q", "motor_pos_{}_deg", factor=100 * 180 / np.pi)
    columns |= per_joint("tau", "motor_torque_{}_Nm", factor=0.01)
    return write_text(folder / "run.csv", columns)


def parquet(folder: Path) -> Path:
    import pyarrow as pa
    import pyarrow.parquet

    columns = {"time": (1e9 * good()["time"]).round().astype("datetime64[ns]")} | per_joint("q", "q{}")
    pyarrow.parquet.write_table(pa.table(columns | per_joint("tau", "tau{}")), folder / "run.parquet")
    return folder / "run.parquet"


def excel(folder: Path) -> Path:
    import openpyxl

    columns = {"Time (s)": good()["time"]} | per_joint("q", "Joint {} position (deg)", factor=180 / np.pi)
    columns |= per_joint("tau", "Joint {} torque (Nm)") | {"Mains power (kW)": good()["power"] / 1000}
    book = openpyxl.Workbook(write_only=True)
    book.create_sheet("Notes").append(["who measured", "nobody"])
    sheet = book.create_sheet("Log")
    sheet.append(["Log of monday"])
    sheet.append(list(columns))
    for row in np.column_stack(list(columns.values())).tolist():
        sheet.append(row)
    book.save(folder / "log.xlsx")
    return folder / "log.xlsx"


@pytest.mark.parametrize(
    ("form", "options", "fields"),
    [
        (german, Options(), "time q torque power"),
        (nameless_units, MAINS, "time q dq torque power"),
        (row_of_units, MAINS, "time q torque power"),
        (iso_times, MAINS, "q torque power"),
        (epoch_times, MAINS, "q torque power"),
        (plot_juggler, Options(), "q dq torque"),
        (motor_side, Options(gear_ratios=("100",)), "time q torque"),
        (parquet, Options(), "time q torque"),
        (excel, Options(), "time q torque power"),
    ],
)
def test_a_log_in_a_dialect_comes_back_in_si_units(
    tmp_path: Path, form: Callable[[Path], Path], options: Options, fields: str
) -> None:
    assert_same(brought(form(tmp_path), options), fields)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["run.bag", "run.mcap", "run"])
def test_a_bag_comes_back_to_the_last_bit(tmp_path: Path, form: str) -> None:
    write(tmp_path / form, *of_run(robot(), signals(good())))
    irtwin_does("import", tmp_path / form, "--robot", NAME, "--power-at", "mains", "--out", tmp_path / "set")
    assert_same(read_data_set(tmp_path / "set"), "q dq torque power temperature", tolerance=0)


def test_a_format_that_a_package_brings_is_imported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(catalogue, "_registered", lambda: (Numbered,))
    joints = [good()[f"{prefix}_{joint}"] for prefix in ("q", "tau") for joint in robot().joint_names]
    np.savetxt(tmp_path / "run.numbered", np.column_stack([good()["time"], *joints]))
    (form,) = bring([tmp_path / "run.numbered"], tmp_path / "set", NAME, MAINS)
    assert form.logs[0].form == ".numbered, by tests"
    assert "read by a package" in form.said
    assert_same(read_data_set(tmp_path / "set"), "time q torque")


def recording_of_rtde(folder: Path, delimiter: str = " ") -> Path:
    """A recording as UR's record.py writes it, by the csv module: the variables of a recipe, vectors numbered."""
    columns = {"timestamp": 7321.5 + good()["time"]}
    columns |= per_joint("q", "target_q_{}", 0) | per_joint("q", "actual_q_{}", 0)
    columns |= per_joint("dq", "actual_qd_{}", 0) | per_joint("tau", "actual_current_{}", 0, factor=0.1)
    columns |= per_joint("tau", "target_moment_{}", 0) | per_joint("temp", "joint_temperatures_{}", 0)
    steady = np.ones(len(good()["time"]))
    columns |= {"actual_robot_voltage": 48.0 * steady, "actual_robot_current": good()["power"] / 48}
    columns |= {"payload": 2.5 * steady, "speed_scaling": steady}
    columns |= {f"payload_cog_{axis}": 0.01 * axis * steady for axis in range(3)}
    with (folder / "robot_data.csv").open("w", newline="") as file:
        writer = csv.writer(file, delimiter=delimiter)
        writer.writerow(columns)
        writer.writerows(np.column_stack(list(columns.values())).tolist())
    return folder / "robot_data.csv"


@pytest.mark.parametrize("delimiter", [" ", ","])  # UR's writer, and that of ur_rtde
def test_a_recording_of_rtde_needs_no_word(tmp_path: Path, delimiter: str) -> None:
    said = irtwin_does("import", recording_of_rtde(tmp_path, delimiter), "--robot", NAME, "--out", tmp_path / "set")
    assert re.search(r"not used, what the controller wanted.*: target_q_0,", said.out)
    data_set = read_data_set(tmp_path / "set")
    assert_same(data_set, "q dq power temperature")
    (run,) = data_set.runs
    np.testing.assert_allclose(run.signals.current, 0.1 * signals(good()).torque)
    assert run.signals.torque is None  # target_moment is no measurement
    assert (run.payload_mass, run.payload_com, data_set.power_at) == (2.5, (0.0, 0.01, 0.02), "dc_bus")
    assert check(data_set).sound


@pytest.mark.system
def test_a_measured_recording_comes_back_to_the_last_bit(tmp_path: Path) -> None:
    if not MEASURED.is_dir():
        pytest.skip("the measured logs are not here")
    true = read_data_set(MEASURED / "ur3_power")
    (run,) = true.runs
    columns = {"timestamp": run.signals.time, "actual_robot_voltage": np.full(len(run.signals.time), 48.0)}
    names = {"q": "actual_q", "dq": "actual_qd", "i": "actual_current", "temp": "joint_temperatures"}
    for prefix, name in names.items():
        for joint, of in enumerate(true.robot.joint_names):
            columns[f"{name}_{joint}"] = columns_of(run.signals, true.robot.joint_names)[f"{prefix}_{of}"]
    log = write_text(tmp_path / "run.csv", columns | {"actual_robot_current": run.signals.power / 48.0}, " ")
    bring([log], tmp_path / "set", str(MEASURED / "ur3_power"), Options())
    (found,) = read_data_set(tmp_path / "set").runs
    for field in ("time", "q", "dq", "current", "temperature"):
        np.testing.assert_array_equal(getattr(found.signals, field), getattr(run.signals, field))
    assert found.signals.power == pytest.approx(run.signals.power)


def test_a_recording_that_ur_rtde_made(tmp_path: Path) -> None:
    """Made by RTDEReceiveInterface.startFileRecording of ur_rtde 1.6.5, of a controller that samples each 8 ms."""
    log = Path(__file__).parent / "data" / "ur_rtde.csv"
    (form,) = bring([log], tmp_path / "set", NAME, Options(maps=("actual_qd_*=dq:rad/s",)))  # they are no derivatives
    assert form.said == [f"{log}: 3 rows left out, the first line 7: they repeat the row before, time and all"]
    data_set = read_data_set(tmp_path / "set")
    (run,) = data_set.runs
    rows, joints = np.round((run.signals.time - 1000.0) / 0.008), np.arange(6)
    angles = rows[:, None] / 30.0 + joints
    currents = np.broadcast_to(0.5 * joints - 0.2, angles.shape)
    for field, true in (("q", np.sin(angles)), ("dq", np.cos(angles)), ("current", currents)):
        np.testing.assert_allclose(getattr(run.signals, field), true, atol=1e-6, err_msg=field)
    assert run.signals.power == pytest.approx(48 * (2.0 + np.sin(rows / 50.0)))
    assert (run.payload_mass, data_set.power_at) == (1.5, "dc_bus")


def test_a_payload_that_changes_is_no_runs_payload(tmp_path: Path) -> None:
    log = recording_of_rtde(tmp_path)
    head, *lines = log.read_text().splitlines()
    place = head.split().index("payload")
    later = [" ".join([*(cells := line.split())[:place], "4.0", *cells[place + 1 :]]) for line in lines[200:]]
    log.write_text("\n".join([head, *lines[:200], *later]))
    with pytest.raises(InputError, match=r"line 202, column payload: the payload changes; cut the log there into two"):
        bring([log], tmp_path / "set", NAME, Options())
