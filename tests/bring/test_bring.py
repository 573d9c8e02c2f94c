"""Logs of others become data sets: the same numbers in SI units; what cannot be told is asked."""

from __future__ import annotations

from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from tests.bring.dialects import NAME, good, per_joint, robot, signals, write_text
from tests.data_sets import irtwin

from irtwin.bring.bring import Options, bring
from irtwin.ros.bags import write_bag
from irtwin.signals.log import DataSet, read_data_set

STARTED = datetime(2026, 3, 2, 8, 0, 0, 250_000, tzinfo=UTC)
MAINS = Options(power_at="mains")


def brought(file: Path, options: Options = MAINS, robot_name: str = NAME) -> DataSet:
    out = file.parent / "set"
    bring([file], out, robot_name, options)
    return read_data_set(out)


def assert_same(data_set: DataSet, fields: str = "time q torque power", tolerance: float = 1e-12) -> None:
    found, true = data_set.runs[0].signals, signals(good())
    for field in fields.split():
        np.testing.assert_allclose(
            getattr(found, field), getattr(true, field), rtol=tolerance, atol=tolerance, err_msg=field
        )


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


@pytest.mark.parametrize("form", ["run.bag", "run.mcap", "run"])
def test_a_bag_comes_back_to_the_last_bit(tmp_path: Path, form: str) -> None:
    write_bag(tmp_path / form, robot(), signals(good()), STARTED)
    said = irtwin("import", tmp_path / form, "--robot", NAME, "--power-at", "mains", "--out", tmp_path / "set")
    assert said.status == 0
    assert_same(read_data_set(tmp_path / "set"), "q dq torque power temperature", tolerance=0)
